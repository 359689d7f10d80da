"""Trajectories, samples and reports to and from files.

Each part is loaded when something is first read or written.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from knotwork.lazy import lazy_names

if TYPE_CHECKING:
    from knotwork.storage.files import finish_interrupted as finish_interrupted
    from knotwork.storage.files import write_file as write_file
    from knotwork.storage.files import write_files as write_files
    from knotwork.storage.reading import knot_disagreement as knot_disagreement
    from knotwork.storage.reading import load_trajectory as load_trajectory
    from knotwork.storage.reading import read_trajectory_document as read_trajectory_document
    from knotwork.storage.reading import trajectory_from_dict as trajectory_from_dict
    from knotwork.storage.sets import digests as digests
    from knotwork.storage.sets import set_disagreement as set_disagreement
    from knotwork.storage.writing import rows_to_csv as rows_to_csv
    from knotwork.storage.writing import to_csv as to_csv
    from knotwork.storage.writing import to_json as to_json
    from knotwork.storage.writing import trajectory_to_dict as trajectory_to_dict

__getattr__, __dir__, __all__ = lazy_names(__name__)
