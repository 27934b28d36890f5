"""`clbrdf models`: what models there are, and the page of one."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import Parameter

from clbrdf.cli.console import number, print_table, stdout_console
from clbrdf.cli.options import JsonFile, Overwrite
from clbrdf.models import Flags, Model, get_model, model_names
from clbrdf.storage.files import whole_text

FLAG_WORDS = {
    Flags.RECIPROCAL: "reciprocal",
    Flags.BOUNDED: "bounded",
    Flags.NEEDS_PHI: "needs azimuths",
    Flags.SIGNED: "may be negative",
    Flags.NEEDS_WAVELENGTH: "needs wavelength",
}
"""Words of the list; MEANINGS says what they promise."""

MEANINGS = {
    Flags.RECIPROCAL: "source and detector may change places",
    Flags.BOUNDED: "reflects at most what it receives, or at most the parameter that is a reflectance",
    Flags.NEEDS_PHI: "depends on both azimuths: the surface has a direction of its own",
    Flags.SIGNED: "can be negative",
    Flags.NEEDS_WAVELENGTH: "depends on the wavelength itself",
}

KINDS = {
    "lobe": "a lobe: add a base, as in {0}+lambert",
    "base": "a base: add lobes, as in ggx+{0}",
    "whole": "a whole surface",
}

OF_A_SUM = "; in a sum it brings its lobe only"


def command(
    name: str | None = None,
    /,
    *,
    force: Annotated[bool, Parameter(negative="")] = False,
    json: JsonFile = None,
    overwrite: Overwrite = False,
) -> None:
    """List the models, or show one: its parameters with their limits, what it promises, its source.

    Parameters
    ----------
    name
        a model as 'clbrdf fit --model' takes it: ggx, ggx+minnaert, wang2013-fresnel, ./phong.py
    force
        allow sums of whole surfaces, such as hapke+rpv
    """
    models = [get_model(text) for text in model_names()] if name is None else [get_model(name, force=force)]
    if name is None:
        _print_list(models)
    else:
        _print_page(models[0])
    if json is not None:
        whole_text(json, {"models": [model_content(model) for model in models]}, overwrite)


def _print_list(models: list[Model]) -> None:
    rows = []
    for model in models:
        names = ", ".join(f"{p.name}*" if p.given == "user" else p.name for p in model.parameters)
        rows.append([model.name, model.kind, names, _flags(model), model.title])
    print_table("Models", ("model", "kind", "parameters", "promises and needs", "title"), rows, left=5)
    stdout_console().print(
        "* has to be fixed. Lobes and bases add up, as in ggx+ggx+lambert; 'clbrdf models NAME' shows limits,"
        " meanings and the source of one."
    )


def _print_page(model: Model) -> None:
    console = stdout_console()
    console.print(f"{model.name}: {model.title}", style="bold")
    console.print(f"source: {model.source}")
    if "+" not in model.name:
        own_base = any(term.base for term in model.terms)
        console.print(KINDS[model.kind].format(model.name) + (OF_A_SUM if own_base else ""))
    rows = []
    for p in model.parameters:
        given = {"user": "to be fixed", "wavelength": "the wavelength"}.get(p.given, "")
        fitted = given or ("linear" if p.linear else f"shape, {p.scale} scale")
        limits = "" if p.given else f"{number(p.bounds[0])} to {number(p.bounds[1])}"
        default = "" if p.given else number(p.default)
        rows.append([p.name, p.unit, default, limits, fitted, p.meaning])
    print_table("", ("parameter", "unit", "default", "limits", "in a fit", "meaning"), rows, left=6)
    promises = [[FLAG_WORDS[flag], MEANINGS[flag]] for flag in FLAG_WORDS if model.flags & flag]
    if promises:
        print_table("", ("promises and needs", ""), promises, left=2)
    if model.terms and "+" not in model.name:
        texts = [[f"{model.name}-{term.name}", f"without {term.meaning}"] for term in model.terms]
        print_table("", ("also", ""), texts, left=2)


def _flags(model: Model) -> str:
    return ", ".join(word for flag, word in FLAG_WORDS.items() if model.flags & flag) or "–"


def model_content(model: Model) -> dict[str, Any]:
    """Return a model's table as plain values for JSON."""
    return {
        "name": model.name,
        "title": model.title,
        "source": model.source,
        "kind": model.kind,
        "flags": [word for flag, word in FLAG_WORDS.items() if model.flags & flag],
        "terms": [{"name": term.name, "meaning": term.meaning} for term in model.terms],
        "parameters": [
            {
                "name": p.name,
                "unit": p.unit,
                "default": p.default,
                "bounds": list(p.bounds),
                "scale": p.scale,
                "linear": p.linear,
                "given": p.given,
                "meaning": p.meaning,
            }
            for p in model.parameters
        ],
    }
