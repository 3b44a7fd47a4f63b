"""Physics engines as models of a rocking block: each plays a scene with box, floor and walls.

The stub `__init__.pyi` lists the classes. Each is loaded when it is first used.
"""

import lazy_loader

if __name__ == "engines":  # found in the folder of the sources: it would be a second copy
    raise ImportError("engines is a part of rockcheck: import rockcheck.engines")

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
