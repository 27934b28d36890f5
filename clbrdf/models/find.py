"""Pages by name: those of the package, those of installed packages, and those in files of one's own.

A page of your own is a file whose name is the model's, with `MODEL = model(...)`. It is found by its path
("./phong.py"), by its name in a folder of the environment variable CLBRDF_MODELS, or as an entry point of the
group "clbrdf.models".
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import os
import pkgutil
from dataclasses import replace
from difflib import get_close_matches
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

from clbrdf.errors import InputError
from clbrdf.models import library
from clbrdf.models.page import Page

FOLDERS = "CLBRDF_MODELS"
GROUP = "clbrdf.models"


def page_names() -> tuple[str, ...]:
    """Names of all pages that are found without a path, sorted."""
    files = (path.stem for folder in _folders() for path in sorted(folder.glob("*.py")))
    return tuple(sorted({*own_names(), *_entries(), *files}))


def find_page(name: str) -> Page:
    """Return the page of a name, or that of a file whose path ends in .py.

    Raises
    ------
    InputError
        There is none, or the file has no page.
    """
    if name.endswith(".py"):
        return _of_file(Path(name).expanduser().resolve())
    if name in own_names() or name in _entries():
        return _installed(name)
    for folder in _folders():
        if (folder / f"{name}.py").is_file():
            return _of_file((folder / f"{name}.py").resolve())
    if not name:
        raise InputError("a model's name, or one of a sum's, is empty; write as in ggx+lambert")
    near = get_close_matches(name, page_names(), n=1, cutoff=0.7)
    meant = f" (did you mean {near[0]}?)" if near else ""
    raise InputError(f"no model is called {name!r}{meant}; there are {', '.join(page_names())}")


@cache
def own_names() -> tuple[str, ...]:
    """Names of the pages of this package."""
    return tuple(module.name for module in pkgutil.iter_modules(library.__path__))


@cache
def _installed(name: str) -> Page:
    if name in own_names():
        page = importlib.import_module(f"{library.__name__}.{name}").MODEL
    else:
        page = _entries()[name].load()
    return replace(_checked(page, f"the model {name!r}"), name=name)


@cache
def _entries() -> dict[str, importlib.metadata.EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def _folders() -> list[Path]:
    listed = (part for part in os.environ.get(FOLDERS, "").split(os.pathsep) if part)
    return [Path(part) for part in listed if Path(part).is_dir()]


def _of_file(path: Path) -> Page:
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: a model's page cannot be read there ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is no text, which a model's page is ({error.reason})") from error
    return _loaded(path, hashlib.sha256(text.encode()).hexdigest())


@cache
def _loaded(path: Path, digest: str) -> Page:
    """Return the page of a file of some content; the digest makes a changed file a new page."""
    name = path.stem
    if not name.isidentifier():
        raise InputError(
            f"{path}: the file's name is the model's, and {name!r} is no name; use letters and _"
        )
    if name in own_names():
        raise InputError(f"{path}: a model {name!r} is part of clbrdf; give the file another name")
    spec = importlib.util.spec_from_file_location(f"clbrdf_page_{name}_{digest[:8]}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"{path}: {type(error).__name__}: {error}") from error
    return replace(_checked(getattr(module, "MODEL", None), str(path)), name=name, file=str(path))


def _checked(page: object, where: str) -> Page:
    if not isinstance(page, Page):
        raise InputError(f"{where}: holds no page; a page says MODEL = clbrdf.models.model(...)")
    return page
