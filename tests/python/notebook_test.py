"""The notebook of the tutorial runs from the first cell to the last."""

import os
import unittest
from pathlib import Path

import drive

try:
    import nbclient
    import nbformat
except ImportError:
    nbclient = None

NOTEBOOK = Path(__file__).resolve().parents[2] / "docs" / "examples" / "tutorial.ipynb"


@unittest.skipIf(nbclient is None, "nbclient is not installed (python3-nbclient, python3-ipykernel)")
class NotebookTest(unittest.TestCase):
    def test_it_runs(self):
        os.environ["PATH"] = f"{Path(drive.PROGRAM).parent}{os.pathsep}{os.environ['PATH']}"
        notebook = nbformat.read(NOTEBOOK, as_version=4)
        client = nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3",
                                         resources={"metadata": {"path": str(NOTEBOOK.parent)}})
        client.execute()
        last = notebook.cells[-1].outputs[-1]
        self.assertEqual(last["data"]["text/plain"], "True")
        # How the notebook in the repository gets its outputs.
        if "LODESTONE_WRITE_NOTEBOOK" in os.environ:
            for cell in notebook.cells:
                cell.metadata = {}
            nbformat.write(notebook, NOTEBOOK)


if __name__ == "__main__":
    unittest.main()
