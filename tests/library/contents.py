"""What the wheel of the library holds, by pyproject.toml."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_BUILD = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["build"]
MODULES = sorted(
    module
    for part in _BUILD["targets"]["wheel"]["only-include"]
    for module in ((ROOT / part).rglob("*.py") if (ROOT / part).is_dir() else [ROOT / part])
    if not module.is_symlink()
)
