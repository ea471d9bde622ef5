"""The examples of README.md and docs/python.md run as they stand there."""

import os
import re
import subprocess
import sys
import unittest

from support import folder, path_of, run

SOURCE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
PAGES = [os.path.join(SOURCE, *page) for page in (("README.md",), ("docs", "python.md"), ("docs", "learning.md"))]


class DocsTest(unittest.TestCase):
    def test_examples_run(self) -> None:
        made = run("map", "forest", "--trees", "60", "--seed", "1", "-o", path_of("forest.pcd"))
        self.assertEqual(made.returncode, 0, made.stderr)
        made = run("map", "import", path_of("forest.pcd"), "-o", path_of("forest.pfmap"), "--resolution", "0.1")
        self.assertEqual(made.returncode, 0, made.stderr)
        examples = []
        for path in PAGES:
            with open(path, encoding="utf-8") as page:
                examples += re.findall(r"```python\n(.*?)```", page.read(), re.DOTALL)
        self.assertGreaterEqual(len(examples), 3)
        for example in examples:
            done = subprocess.run(
                [sys.executable, "-c", example], cwd=folder().name, capture_output=True, text=True, check=False
            )
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(done.stdout)


if __name__ == "__main__":
    unittest.main()
