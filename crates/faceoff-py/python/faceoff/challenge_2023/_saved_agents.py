"""Agents in the files of MushroomRL (`save`, `load`): a ZIP file with one entry per attribute.

A class lists its attributes with the way in which each is saved: `primitive` and `pickle` (pickle), `numpy`, `json`,
`torch`, `mushroom` (an object of the same kind, in a folder of the file), or `none` (not saved, and None after
loading). A `!` at the end saves an attribute only on request.
"""

from __future__ import annotations

import copy
import json
import pickle
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any
from zipfile import BadZipFile, ZipFile

import numpy as np

from faceoff.challenge_2023 import _stand_ins
from faceoff.challenge_2023._arguments import path_of
from faceoff.errors import ArgumentError

if TYPE_CHECKING:
    # Bundles also run on Python 3.10, which does not have it.
    from typing import Self

#: Names of the entry that describes an object, in newer and older versions of MushroomRL.
_DESCRIPTIONS = ("config", "agent.config")
_METHODS = ("primitive", "pickle", "numpy", "json", "torch", "mushroom", "none")


class Savable:
    """What an agent of MushroomRL can save of itself."""

    _save_attributes: dict[str, str]

    def _add_save_attr(self, **attributes: str) -> None:
        """Adds attributes to those that `save` writes: their names, and how each is saved."""
        for name, method in attributes.items():
            if method.removesuffix("!") not in _METHODS:
                raise ArgumentError(f"_add_save_attr: {name}: expected one of {', '.join(_METHODS)}, got {method!r}")
        if "_save_attributes" not in vars(self):
            self._save_attributes = {}
        self._save_attributes.update(attributes)

    def _post_load(self) -> None:
        """Called after loading."""

    def copy(self) -> Self:
        """A deep copy."""
        return copy.deepcopy(self)

    def save(self, path: str | Path, full_save: bool = False) -> None:
        """Writes the agent into one file. `full_save` includes the attributes that are saved only on request."""
        path = path_of("path", path, "a file")
        path.parent.mkdir(parents=True, exist_ok=True)
        with ZipFile(path, "w") as archive:
            _write(self, archive, full_save, "")

    @classmethod
    def load(cls, path: str | Path) -> Any:
        """Reads an agent from a file that `save`, of this class or of MushroomRL, has written."""
        path = path_of("path", path, "a file")
        if not path.is_file():
            raise ArgumentError(f"path: expected the file of a saved agent, got {str(path)!r}, which is no file")
        try:
            with ZipFile(path) as archive:
                loaded = _read(archive, "")
        except BadZipFile:
            raise ArgumentError(f"path: expected the file of a saved agent (ZIP), got {str(path)!r}") from None
        if loaded is None:
            raise ArgumentError(f"path: expected a saved agent with the entry 'config', got {str(path)!r} without it")
        return loaded


class _Unpickler(pickle.Unpickler):
    """Reads files that name MushroomRL's descriptions of spaces, which every saved agent contains."""

    def find_class(self, module_name: str, global_name: str) -> Any:
        if module_name.startswith("mushroom_rl.") and global_name in ("Box", "MDPInfo"):
            return getattr(_stand_ins, global_name)
        return super().find_class(module_name, global_name)


def _write(value: Any, archive: ZipFile, full_save: bool, folder: str) -> None:
    if isinstance(value, list):
        _describe(archive, folder, list, {}, {"len": len(value)})
        for index, element in enumerate(value):
            _write(element, archive, full_save, f"{folder}/{index}")
        return
    attributes = getattr(value, "_save_attributes", None)
    if attributes is None:  # spaces, for example: all attributes as they are
        attributes = dict.fromkeys(vars(value), "primitive")
    primitives = {}
    for name, method in attributes.items():
        attribute = getattr(value, name, None)
        if attribute is None or method == "none" or (method.endswith("!") and not full_save):
            continue
        method = method.removesuffix("!")
        entry = _join(folder, f"{name}.{method}")
        if method == "primitive":
            primitives[name] = attribute
        elif method == "mushroom":
            _write(attribute, archive, full_save, entry)
        else:
            with archive.open(entry, "w") as file:
                _write_entry(method, file, attribute)
    _describe(archive, folder, type(value), dict(attributes), primitives)


def _describe(
    archive: ZipFile, folder: str, kind: type, attributes: dict[str, str], primitives: dict[str, Any]
) -> None:
    with archive.open(_join(folder, _DESCRIPTIONS[0]), "w") as file:
        pickle.dump({"type": kind, "save_attributes": attributes, "primitive_dictionary": primitives}, file)


def _write_entry(method: str, file: IO[bytes], attribute: Any) -> None:
    if method == "pickle":
        pickle.dump(attribute, file)
    elif method == "numpy":
        np.save(file, attribute)
    elif method == "json":
        file.write(json.dumps(attribute).encode())
    else:
        import torch

        torch.save(attribute, file)


def _read(archive: ZipFile, folder: str) -> Any:
    """The object in a folder of the file; None if there is none."""
    entries = set(archive.namelist())
    described = [name for name in (_join(folder, entry) for entry in _DESCRIPTIONS) if name in entries]
    if not described:
        return None
    with archive.open(described[0]) as file:
        description = _Unpickler(file).load()
    kind, primitives = description["type"], description["primitive_dictionary"]
    if kind is list:
        return [_read(archive, f"{folder}/{index}") for index in range(primitives["len"])]
    value = kind.__new__(kind)
    attributes = description["save_attributes"]
    if issubclass(kind, Savable):
        value._save_attributes = attributes
    for name, method in attributes.items():
        method = method.removesuffix("!")
        entry = _join(folder, f"{name}.{method}")
        if method == "primitive":
            attribute = primitives.get(name)
        elif method == "mushroom":
            attribute = _read(archive, entry)
        elif entry in entries:
            with archive.open(entry) as file:
                attribute = _read_entry(method, file)
        else:
            attribute = None
        setattr(value, name, attribute)
    if isinstance(value, Savable):
        value._post_load()
    return value


def _read_entry(method: str, file: IO[bytes]) -> Any:
    if method == "pickle":
        return _Unpickler(file).load()
    if method == "numpy":
        return np.load(file)
    if method == "json":
        return json.load(file)
    import torch

    return torch.load(file, map_location="cpu", weights_only=False)


def _join(folder: str, name: str) -> str:
    return f"{folder}/{name}" if folder else name
