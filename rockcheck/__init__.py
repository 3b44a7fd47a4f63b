"""Validation harness for rocking-block models: one scene, several models, compared and judged.

All public names can be imported from here, as the stub `__init__.pyi` lists them; each is loaded
when it is first used, so that `import rockcheck` costs next to nothing. The parts lie in
`rockcheck.scenes`, `rockcheck.ebm`, `rockcheck.cm`, `rockcheck.engines`, `rockcheck.validation` and
`rockcheck.reports`.
"""

import os

import lazy_loader

# Git writes a file where it may make no link.
if os.path.isfile(os.path.join(os.path.dirname(__file__), "scenes")):
    raise ImportError(
        "rockcheck/scenes is no link to scenes/: git config core.symlinks true, then check out"
        " again"
    )

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
