"""How these tests run."""

from tests.quick_compiling import quick_compiling as quick_compiling
