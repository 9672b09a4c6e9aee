"""Descriptions from YAML files, and back."""

import io
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.scalarbool import ScalarBoolean

from rollerbench.description.problems import Location, problems_of
from rollerbench.description.robot import Robot
from rollerbench.errors import DescriptionError, ResourceError
from rollerbench.resources import robot_file

Model = TypeVar("Model", bound=BaseModel)


def load_robot(source: str | Path | Mapping[str, Any] | Robot) -> Robot:
    """A robot from the name of a shipped one, a path to a robot.yaml, its content, or a Robot (returned as it is).

    Raises:
        ResourceError: there is no such robot.
        DescriptionError: it is not a valid robot; the message names file, line, field, value and what is accepted.
    """
    if isinstance(source, Robot):
        return source
    if isinstance(source, Mapping):
        return validate(Robot, source)
    path = robot_file(source)
    return validate(Robot, read_yaml(path), path)


def read_yaml(path: Path) -> CommentedMap:
    """The mapping in a YAML file, with line numbers.

    Raises:
        ResourceError: the file cannot be read.
        DescriptionError: it is not YAML, or not a mapping.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ResourceError(f"{path}: cannot be read as text: {error}") from error
    try:
        data = YAML(typ="rt").load(text)
    except MarkedYAMLError as error:
        line = f":{error.problem_mark.line + 1}" if error.problem_mark else ""
        what = str(error.problem or error.context).split("\n")[0]
        raise DescriptionError(f"{path}{line}: not valid YAML: {what}") from error
    except (YAMLError, ValueError, RecursionError) as error:
        raise DescriptionError(f"{path}: not valid YAML: {error}") from error
    if not isinstance(data, CommentedMap):
        raise DescriptionError(f"{path}: expected a mapping of keys to values, found {type(data).__name__}")
    return data


def validate(model: type[Model], data: Mapping[str, Any], path: Path | None = None) -> Model:
    """Builds a model from parsed YAML.

    Raises:
        DescriptionError: with all problems, one a line.
    """
    try:
        return model.model_validate(_plain(data), context={"folder": path.parent if path else None})
    except ValidationError as error:
        lines = []
        for problem in problems_of(error, model):
            where = f"{path}:{_line_of(data, problem.location)}: " if path else ""
            lines.append(f"{where}{problem}")
        raise DescriptionError("\n".join(lines)) from error


def to_yaml(data: BaseModel | Mapping[str, Any]) -> str:
    """The model, or plain data, as YAML text; fields of models that have their default are left out."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 110
    stream = io.StringIO()
    yaml.dump(_plain_value(data), stream)
    return stream.getvalue()


def write_atomically(path: Path, content: str | bytes) -> None:
    """Writes a file under a temporary name beside it, then renames it: a crash leaves no half-written file."""
    data = content.encode("utf-8") if isinstance(content, str) else content
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        mask = os.umask(0)
        os.umask(mask)
        Path(temporary).chmod(0o666 & ~mask)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _tagged(model: BaseModel) -> dict[str, Any]:
    """Fields that differ from their default, as plain data; union tags (type) always."""
    result: dict[str, Any] = {}
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        if name == "type" or value != field.get_default(call_default_factory=True):
            result[name] = _plain_value(value)
    for name, value in (model.model_extra or {}).items():
        result[name] = _plain_value(value)
    return result


def _plain_value(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return _tagged(value)
    if isinstance(value, Mapping):
        return {key: _plain_value(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain_value(item) for item in value]
    return str(value) if isinstance(value, Path) else value


def _plain(value: Any) -> Any:
    """Ruamel's containers and scalars as Python's own, so that messages show plain values."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, ScalarBoolean):
        return bool(value)
    for kind in (bool, int, float, str):
        if isinstance(value, kind):
            return value if type(value) is kind else kind(value)
    return value


def _line_of(data: Any, location: Location) -> int:
    """Line (from 1) of the deepest part of the location that the file holds."""
    line = 0
    for step in location:
        try:
            if isinstance(data, CommentedMap) and step in data:
                line = data.lc.key(step)[0]
            elif isinstance(data, CommentedSeq) and isinstance(step, int) and step < len(data):
                line = data.lc.item(step)[0]
            else:
                break
        except (AttributeError, KeyError):
            break
        data = data[step]
    return int(line) + 1
