from . import documents as documents
from . import export as export
from . import foreign as foreign
from . import storage as storage

__all__: list[str]
