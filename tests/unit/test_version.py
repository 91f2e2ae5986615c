"""The version is that of the installed package."""

import re
from importlib import metadata

import fingerslip as fs


def test_version_is_that_of_the_installed_package():
    assert fs.__version__ == metadata.version("fingerslip")
    assert re.match(r"\d+\.\d+", fs.__version__)
