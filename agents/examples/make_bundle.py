"""Makes a bundle of trained weights, to be evaluated and uploaded.

    python agents/examples/make_bundle.py agents/examples/trained/ppo/weights.npz my-learned-agent

The network becomes `policy.onnx`, with the normalisation of what it sees baked in; beside it goes what of the package
`faceoff` the agent uses. Needs `onnx`. The bundle's runtime is `python3-ml` (docs/sandbox.md).
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

import faceoff
import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from network import LARGEST, Saved

HERE = Path(__file__).parent
PACKAGE = Path(faceoff.__file__).parent
#: Of the package: the protocol's loop, and where joints bring the mallet. They need NumPy alone.
TAKEN_ALONG = ("__init__.py", "agent.py", "errors.py", "kinematics")


def main() -> None:
    """Reads arguments, writes a folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("weights", type=Path)
    parser.add_argument("folder", type=Path, help="is made; its name is the agent's")
    given = parser.parse_args()
    if not given.weights.is_file():
        sys.exit(f"{given.weights}: expected weights that a training wrote, found no such file")
    if given.folder.exists():
        sys.exit(f"{given.folder} is there already; choose another name, or remove it first")
    make(given.weights, given.folder)
    print(f"{given.folder}: try it with\n  faceoff eval {given.folder} --task defend --episodes 100 --config CONFIG")


def make(weights: Path, folder: Path) -> None:
    """Writes the bundle."""
    network = graph(Saved(weights))
    folder.mkdir(parents=True)
    manifest = (HERE / "bundle" / "agent.toml").read_text()
    (folder / "agent.toml").write_text(manifest.replace("{{name}}", folder.name))
    for source in (HERE / "bundle" / "agent.py", HERE / "player.py", HERE / "view.py"):
        shutil.copy(source, folder)
    for part in TAKEN_ALONG:
        source, copy = PACKAGE / part, folder / "faceoff" / part
        copy.parent.mkdir(exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, copy, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, copy)
    onnx.save(network, folder / "policy.onnx")


def graph(policy: Saved) -> onnx.ModelProto:
    """`seen` (n, inputs), as `view.py` makes it, to `action` (n, outputs), float32 both."""
    constants = dict(policy.parts)
    constants |= {"least": np.array(-LARGEST, np.float32), "greatest": np.array(LARGEST, np.float32)}
    nodes = [
        helper.make_node("Sub", ["seen", "mean"], ["centred"]),
        helper.make_node("Div", ["centred", "deviation"], ["scaled"]),
        helper.make_node("Clip", ["scaled", "least", "greatest"], ["layer0"]),
    ]
    for index in range(policy.layers):
        is_last = index == policy.layers - 1
        made = "action" if is_last else f"sum{index}"
        nodes.append(helper.make_node("Gemm", [f"layer{index}", f"weight{index}", f"bias{index}"], [made]))
        if not is_last:
            nodes.append(helper.make_node("Tanh", [made], [f"layer{index + 1}"]))
    inputs = len(policy.parts["mean"])
    outputs = len(policy.parts[f"bias{policy.layers - 1}"])
    model = helper.make_model(
        helper.make_graph(
            nodes,
            "policy",
            [helper.make_tensor_value_info("seen", TensorProto.FLOAT, ["n", inputs])],
            [helper.make_tensor_value_info("action", TensorProto.FLOAT, ["n", outputs])],
            [numpy_helper.from_array(value, name) for name, value in constants.items()],
        ),
        # What ONNX Runtime of the runtime reads; a newer onnx would write a newer version.
        opset_imports=[helper.make_opsetid("", 17)],
        ir_version=8,
    )
    onnx.checker.check_model(model, full_check=True)
    return model


if __name__ == "__main__":
    main()
