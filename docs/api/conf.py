"""Reference of the library, from its docstrings: `make api` builds it into build/api and runs its examples."""

import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "library"))

project = "softground"
author = copyright = "The SoftGround authors"
release = version = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.doctest"]
html_theme = "pydata_sphinx_theme"
autodoc_typehints = "none"  # types stand in the docstrings, with shapes and units
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_ivar = True
doctest_global_setup = "import numpy as np; np.set_printoptions(legacy='1.21'); from softground import *"
