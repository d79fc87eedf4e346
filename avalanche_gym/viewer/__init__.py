"""The web viewer: demos, environments and policies in a browser. Needs the extra ``viewer``."""

from .catalogue import Catalogue
from .server import Viewer

__all__ = ["Catalogue", "Viewer"]
