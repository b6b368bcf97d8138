"""What building adds to the sources: the parser's tables, which take a second to make."""

import shutil
import subprocess
import sys

from setuptools import setup
from setuptools.command.build_py import build_py

LAY = "from mechc.lang.grammar.tables import lay_beside_the_grammar; lay_beside_the_grammar()"


class WithTables(build_py):
    def run(self) -> None:
        if not self.editable_mode:  # what an earlier build left there would go into the wheel
            shutil.rmtree(self.build_lib, ignore_errors=True)
        super().run()
        if not self.editable_mode:  # a checkout keeps them in the cache folder
            subprocess.run([sys.executable, "-c", LAY], cwd=self.build_lib, check=True)


setup(cmdclass={"build_py": WithTables})
