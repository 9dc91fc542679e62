# SPDX-License-Identifier: Apache-2.0
"""The examples run as they are, and leave a picture with something in it."""
import os
import pathlib
import subprocess
import tempfile
import unittest

import matplotlib.image

EXAMPLES = pathlib.Path(os.environ["MELTSTAGE_ROOT"]) / "examples/python"
SAYS = {
    "heat_the_chip": "Rate: Temperature moved by more than DTDT_MAX",
    "plan_a_path": "no order takes less than",
    "replay_vectors": "12000000 cycles agree; first mismatch: None",
}


class Examples(unittest.TestCase):
    def test_each_draws_its_picture(self):
        self.assertEqual({path.stem for path in EXAMPLES.glob("*.py")}, set(SAYS))
        for name, says in SAYS.items():
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                done = subprocess.run(
                    ["/usr/bin/python3", "-B", EXAMPLES / f"{name}.py"],
                    cwd=folder, env={**os.environ, "MPLBACKEND": "Agg", "MPLCONFIGDIR": folder}, capture_output=True, text=True, check=False,
                )  # fmt: skip
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.assertIn(says, done.stdout)
                picture = matplotlib.image.imread(pathlib.Path(folder) / f"{name}.png")
                self.assertGreater(picture.std(), 0.05)  # a blank page: 0


if __name__ == "__main__":
    unittest.main()
