"""Faults of a description: where they are, what was found, what is accepted."""

import difflib
import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import PydanticCustomError

Location = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Problem:
    """One fault.

    Attributes:
        location: Path to the field, such as ("wheels", 0, "radius").
        message: What is wrong, and what is accepted.
        value: What was found there; None where nothing was.
    """

    location: Location
    message: str
    value: object = None

    @property
    def field(self) -> str:
        """The location as people write it: wheels[0].radius."""
        text = ""
        for step in self.location:
            text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
        return text or "file"

    def __str__(self) -> str:
        shown = "" if self.value is None else f" = {_shorten(self.value)}"
        return f"{self.field}{shown}: {self.message}"


def refuse(problems: list[Problem]) -> None:
    """Raises a validation error that carries the problems, if there are any; for use in validators."""
    if problems:
        text = "; ".join(str(problem) for problem in problems)
        raise PydanticCustomError("problems", "{text}", {"text": text, "problems": problems})


def problems_of(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """The problems in a pydantic error, in words that say what is accepted."""
    found: list[Problem] = []
    for item in error.errors(include_url=False):
        context: Mapping[str, Any] = item.get("ctx", {})
        location, models = _resolve(item["loc"], model)
        if item["type"] == "problems":
            found += [replace(problem, location=(*location, *problem.location)) for problem in context["problems"]]
            continue
        message, value = item["msg"].removeprefix("Value error, "), item["input"]
        match item["type"]:
            case "extra_forbidden":
                message = _unknown_key(str(location[-1]), models)
            case "missing":
                message, value = "this field is required", None
            case "union_tag_invalid":
                location = (*location, context["discriminator"].strip("'"))
                message, value = f"accepted: {context['expected_tags']}", context["tag"]
            case "union_tag_not_found":
                location = (*location, context["discriminator"].strip("'"))
                message, value = "this field is required", None
            case "value_error":
                # A validator's own words name the fields and values of the part.
                value = None if isinstance(value, dict) else value
        found.append(Problem(location, message, value))
    # A list whose items are all faulty counts as empty for pydantic: its items say more.
    return [p for p in found if not any(_inside(other.location, p.location) for other in found)]


def _inside(location: Location, outer: Location) -> bool:
    return len(location) > len(outer) and location[: len(outer)] == outer


def _shorten(value: object, limit: int = 80) -> str:
    text = repr(value)
    return text if len(text) <= limit else text[: limit - 3] + "..."


def _unknown_key(key: str, models: list[type[BaseModel]]) -> str:
    names = sorted({name for model in models for name in model.model_fields})
    close = difflib.get_close_matches(key, names, n=1)
    hint = f"did you mean {close[0]}? " if close else ""
    return f"unknown key: {hint}accepted: {', '.join(names)}"


def _resolve(location: tuple[int | str, ...], model: type[BaseModel]) -> tuple[Location, list[type[BaseModel]]]:
    """The location without pydantic's union tags, and the models that its last step belongs to."""
    owners: list[type[BaseModel]] = [model]
    steps: list[str | int] = []
    pending: list[type[BaseModel]] = [model]
    keyed = False
    for step in location:
        tagged = [m for m in pending if isinstance(step, str) and step in _tags(m)]
        if len(pending) > 1 and tagged:
            pending = tagged
            continue
        steps.append(step)
        if keyed:
            # A key of a mapping, such as a wheel's name: the models are those of its values.
            keyed = False
        elif isinstance(step, str):
            owners = pending
            annotations = [owner.model_fields[step].annotation for owner in owners if step in owner.model_fields]
            pending = [found for annotation in annotations for found in _models_in(annotation)]
            keyed = any(get_origin(annotation) is dict for annotation in annotations)
    return tuple(steps), owners


def _tags(model: type[BaseModel]) -> tuple[Any, ...]:
    return get_args(model.model_fields["type"].annotation) if "type" in model.model_fields else ()


def _models_in(annotation: object) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and not get_origin(annotation) and issubclass(annotation, BaseModel):
        yield annotation
    elif get_origin(annotation) in (Union, types.UnionType) or get_args(annotation):
        for argument in get_args(annotation):
            yield from _models_in(argument)
