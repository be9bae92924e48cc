"""The code of `docs/python.md` runs as it is written."""

import re
import subprocess
import sys
from pathlib import Path

DOCUMENT = Path(__file__).parents[3] / "docs" / "python.md"


def test_code_of_the_page_runs(tmp_path: Path) -> None:
    found = re.findall(r"```python\n(.*?)```", DOCUMENT.read_text(), re.DOTALL)
    # Policies and agents have tests of their own: test_export.py, also that of the libraries with torch.
    blocks = [block for block in found if not any(word in block for word in ("export(", "Agent", "motion."))]
    assert len(blocks) >= 3
    # One namespace, as for a reader who types everything; a script, since `evaluate` starts workers.
    (tmp_path / "page.py").write_text("\n".join(blocks))
    done = subprocess.run([sys.executable, "page.py"], cwd=tmp_path, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.split()[0]) >= 0.0
