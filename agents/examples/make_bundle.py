"""Makes a bundle, the folder of an agent, from trained weights, for evaluation and submission.

    python agents/examples/make_bundle.py agents/examples/trained/ppo/weights.npz my-learned-agent

The network becomes `policy.onnx`, which includes the normalisation of its input. The bundle also contains the parts of
the package `faceoff` that the agent uses. Needs `onnx`. The bundle's runtime is `python3-ml` (docs/sandbox.md).
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

from network import CLIP_DEVIATIONS, SavedPolicy

HERE = Path(__file__).parent
PACKAGE = Path(faceoff.__file__).parent
#: Parts of the package for the bundle: the protocol loop and the kinematics. They need only NumPy.
BUNDLED_PARTS = ("__init__.py", "agent.py", "errors.py", "kinematics")


def main() -> None:
    """Makes the bundle named by the command-line arguments."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("weights", type=Path)
    parser.add_argument("folder", type=Path, help="folder to create; its name is the agent's")
    arguments = parser.parse_args()
    if not arguments.weights.is_file():
        sys.exit(f"{arguments.weights}: expected the weights of a training, found no such file")
    if arguments.folder.exists():
        sys.exit(f"{arguments.folder} exists already; choose another name, or remove it first")
    make(arguments.weights, arguments.folder)
    command = f"faceoff eval {arguments.folder} --task defend --episodes 100 --config CONFIG"
    print(f"{arguments.folder}: try it with\n  {command}")


def make(weights: Path, folder: Path) -> None:
    """Writes the bundle."""
    network = onnx_model(SavedPolicy(weights))
    folder.mkdir(parents=True)
    manifest = (HERE / "bundle" / "agent.toml").read_text()
    (folder / "agent.toml").write_text(manifest.replace("{{name}}", folder.name))
    for source in (HERE / "bundle" / "agent.py", HERE / "player.py", HERE / "view.py"):
        shutil.copy(source, folder)
    for part in BUNDLED_PARTS:
        source, copy = PACKAGE / part, folder / "faceoff" / part
        copy.parent.mkdir(exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, copy, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, copy)
    onnx.save(network, folder / "policy.onnx")


def onnx_model(policy: SavedPolicy) -> onnx.ModelProto:
    """The network as ONNX: from `view` (n, inputs), the features of `view.py`, to `action` (n, outputs), both float32."""
    constants = dict(policy.parts)
    constants |= {"least": np.array(-CLIP_DEVIATIONS, np.float32), "greatest": np.array(CLIP_DEVIATIONS, np.float32)}
    nodes = [
        helper.make_node("Sub", ["view", "mean"], ["centred"]),
        helper.make_node("Div", ["centred", "deviation"], ["scaled"]),
        helper.make_node("Clip", ["scaled", "least", "greatest"], ["layer0"]),
    ]
    for index in range(policy.layers):
        is_last = index == policy.layers - 1
        output = "action" if is_last else f"sum{index}"
        nodes.append(helper.make_node("Gemm", [f"layer{index}", f"weight{index}", f"bias{index}"], [output]))
        if not is_last:
            nodes.append(helper.make_node("Tanh", [output], [f"layer{index + 1}"]))
    inputs = len(policy.parts["mean"])
    outputs = len(policy.parts[f"bias{policy.layers - 1}"])
    model = helper.make_model(
        helper.make_graph(
            nodes,
            "policy",
            [helper.make_tensor_value_info("view", TensorProto.FLOAT, ["n", inputs])],
            [helper.make_tensor_value_info("action", TensorProto.FLOAT, ["n", outputs])],
            [numpy_helper.from_array(value, name) for name, value in constants.items()],
        ),
        # Versions that the runtime's ONNX Runtime can read; a newer onnx would write newer ones.
        opset_imports=[helper.make_opsetid("", 17)],
        ir_version=8,
    )
    onnx.checker.check_model(model, full_check=True)
    return model


if __name__ == "__main__":
    main()
