"""Turns a mapping of names to values into a validated dataclass.

One flat set of names, as ROS keeps parameters; the dataclass may nest other dataclasses, one struct
per model. Nothing is converted or repaired: a wrong value is refused in one line that says who, what,
what was given and what is allowed.
"""

from __future__ import annotations

import dataclasses
import difflib
import typing
from typing import Any, Dict, Iterable, Iterator, List, Mapping, Sequence, Tuple, Type, TypeVar

T = TypeVar("T")
_LOWEST, _HIGHEST, _CHOICES = "lowest", "highest", "choices"  # keys of a field's metadata


class ParamError(ValueError):
    """A parameter that cannot be used; the text says which and why."""


def number(default: Any, lowest: float, highest: float) -> Any:
    """A field of a dataclass: an int or a float from lowest to highest, both included."""
    return dataclasses.field(default=default, metadata={_LOWEST: lowest, _HIGHEST: highest})


def choice(default: str, choices: Sequence[str]) -> Any:
    """A field of a dataclass: one of some words."""
    return dataclasses.field(default=default, metadata={_CHOICES: tuple(choices)})


def limits(cls: type) -> Dict[str, Tuple[float, float]]:
    """Name -> the lowest and the highest value, of all fields made by number()."""
    return {
        field.name: (field.metadata[_LOWEST], field.metadata[_HIGHEST])
        for field, _ in _leaves(cls)
        if _LOWEST in field.metadata
    }


def choices(cls: type) -> Dict[str, Tuple[str, ...]]:
    """Name -> the words that it can be, of all fields made by choice()."""
    return {field.name: field.metadata[_CHOICES] for field, _ in _leaves(cls) if _CHOICES in field.metadata}


def names(cls: type) -> List[str]:
    """All parameter names that a dataclass takes, nested ones included."""
    return [field.name for field, _ in _leaves(cls)]


def load(cls: Type[T], mapping: Mapping[str, Any], owner: str) -> T:
    """An instance of the dataclass cls with the values of the mapping, defaults for the rest.

    Args:
        cls: dataclass; fields are bool, int, float, str, Tuple[str, ...], or dataclasses of these.
        mapping: flat names -> values; an int is taken for a float, a whole float for an int and a list for a tuple, as
            launch files write them; nothing else is converted.
        owner: who is asking, the first word of an error ("/localization", "params.yaml").

    Raises:
        ParamError: unknown name, wrong type, a value beyond its limits, or one that the dataclass refuses.
    """
    known = {field.name: (field, kind) for field, kind in _leaves(cls)}
    for name in mapping:
        if name not in known:
            raise ParamError(unknown(name, known, owner))
    checked: Dict[str, Any] = {name: _checked(owner, *known[name], value) for name, value in mapping.items()}
    return _build(cls, checked, owner)


def type_fault(cls: type, name: str, value: Any) -> str:
    """Why the value is not of the type of a parameter of cls, without its owner; "" if it is."""
    for field, kind in _leaves(cls):
        if field.name == name:
            try:
                _typed("", name, kind, value)
            except ParamError as err:
                return str(err).partition(": ")[2]
    return ""


def unknown(name: str, known: Iterable[str], owner: str) -> str:
    """The line on a name that is not among the known ones."""
    near = difflib.get_close_matches(str(name), sorted(known), n=1)
    hint = f"; did you mean ~{near[0]}?" if near else ""
    return f"{owner}: unknown parameter ~{name}{hint}"


def as_mapping(instance: Any) -> Dict[str, Any]:
    """The flat mapping that load() would turn into an equal instance."""
    flat: Dict[str, Any] = {}
    for field in dataclasses.fields(instance):
        value = getattr(instance, field.name)
        flat.update(
            as_mapping(value)
            if dataclasses.is_dataclass(value)
            else {field.name: list(value) if isinstance(value, tuple) else value}
        )
    return flat


def _leaves(cls: type) -> "Iterator[Tuple[dataclasses.Field[Any], type]]":
    kinds = typing.get_type_hints(cls)
    for field in dataclasses.fields(cls):
        kind = kinds[field.name]
        if dataclasses.is_dataclass(kind):
            yield from _leaves(kind)  # type: ignore[arg-type]
        else:
            yield field, kind


def _checked(owner: str, field: "dataclasses.Field[Any]", kind: type, value: Any) -> Any:
    """The value in the type of its field, if it is within its limits."""
    value = _typed(owner, field.name, kind, value)
    words = field.metadata.get(_CHOICES)
    if words is not None and value not in words:
        raise ParamError(f"{owner}: ~{field.name} must be one of {', '.join(words)}, got {value!r}")
    if _LOWEST in field.metadata:
        lowest, highest = field.metadata[_LOWEST], field.metadata[_HIGHEST]
        if not lowest <= value <= highest:
            raise ParamError(f"{owner}: ~{field.name} must be in [{lowest:.10g}, {highest:.10g}], got {value}")
    return value


def _typed(owner: str, name: str, kind: type, value: Any) -> Any:
    if kind is float and type(value) is int:
        return float(value)
    if kind is int and type(value) is float and value.is_integer():
        return int(value)
    if kind == Tuple[str, ...]:
        if isinstance(value, (list, tuple)) and all(type(item) is str for item in value):
            return tuple(value)
        raise ParamError(f"{owner}: ~{name} must be a list of str, got {value!r}")
    if type(value) is not kind:  # bool is an int to isinstance, and "0" would be True to bool()
        raise ParamError(f"{owner}: ~{name} must be {kind.__name__}, got {value!r}")
    return value


def _build(cls: Type[T], checked: Mapping[str, Any], owner: str) -> T:
    kinds = typing.get_type_hints(cls)
    arguments: Dict[str, Any] = {}
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        kind = kinds[field.name]
        if dataclasses.is_dataclass(kind):
            arguments[field.name] = _build(kind, checked, owner)  # type: ignore[arg-type, type-var]
        elif field.name in checked:
            arguments[field.name] = checked[field.name]
    try:
        return cls(**arguments)
    except ParamError:
        raise
    except ValueError as err:
        raise ParamError(f"{owner}: {err}") from err
