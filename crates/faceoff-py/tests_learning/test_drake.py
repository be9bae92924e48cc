"""Drake, whose package is large, loads the exported URDF."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

PROGRAM = Path(os.environ.get("TARGET_DIR", "target")) / "debug" / "faceoff"


def test_drake_finds_the_mass_of_the_arm() -> None:
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    urdf = subprocess.run([PROGRAM, "sim", "export", "--format", "urdf"], check=True, capture_output=True, text=True).stdout
    arm = MultibodyPlant(time_step=0.001)
    Parser(arm).AddModelsFromString(urdf, "urdf")
    arm.WeldFrames(arm.world_frame(), arm.GetFrameByName("base"))
    arm.Finalize()
    context = arm.CreateDefaultContext()
    # Seven links, the end effector and the mallet, kg.
    expected = 8.240527 + 6.357896 + 4.042756 + 3.642249 + 2.580896 + 2.760564 + 1.285417 + 0.1 + 0.283
    assert arm.CalcTotalMass(context) == pytest.approx(expected, abs=1e-9)
    arm.SetPositions(context, np.full(9, 0.1))
    eigenvalues = np.linalg.eigvalsh(arm.CalcMassMatrix(context))
    assert eigenvalues.min() > 1e-4
