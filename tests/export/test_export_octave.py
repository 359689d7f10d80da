"""GNU Octave reads the MAT-file, and `ppval` gives the motion."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from knotwork import Plan, plan

OCTAVE = shutil.which("octave-cli")
SCRIPT = """
s = load('motion.mat');
pp = mkpp(s.breaks, s.coefs, s.d);
q = ppval(pp, linspace(s.breaks(1), s.breaks(end), 1000));
v = ppval(ppder(s.pp), linspace(s.breaks(1), s.breaks(end), 1000));
dlmwrite('q.csv', q', 'precision', '%.17g');
dlmwrite('v.csv', v', 'precision', '%.17g');
printf('%s\\n', s.joint_names{:});
"""


@pytest.mark.skipif(OCTAVE is None, reason="GNU Octave is not installed")
@pytest.mark.parametrize("planner", ["modified-hermite", "quintic:estimated"])
def test_ppval_gives_the_motion(planner: str, tmp_path: Path) -> None:
    curve = plan("ur5_deburring", planner=planner).trajectory
    (tmp_path / "motion.mat").write_bytes(curve.to_mat())
    (tmp_path / "read.m").write_text(SCRIPT, encoding="utf-8")
    assert OCTAVE is not None
    command = [OCTAVE, "--no-gui", "--no-init-file", "read.m"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.stdout.split() == list(curve.joint_names), ran.stderr
    time = np.linspace(curve.start_time, curve.end_time, 1000)
    for order, name in enumerate(("q.csv", "v.csv")):
        found = np.loadtxt(tmp_path / name, delimiter=",")
        np.testing.assert_allclose(found, curve(time, order), rtol=0, atol=1e-12)


def test_the_recipe_is_the_one_documented(deburring: Plan) -> None:
    from knotwork.files.export import to_mat

    assert to_mat.__doc__ is not None
    for line in SCRIPT.strip().splitlines()[1:3]:
        assert line in to_mat.__doc__
