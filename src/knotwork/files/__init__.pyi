from . import documents as documents
from . import foreign as foreign
from . import storage as storage

__all__: list[str]
