import pytest

from tests.identification.made_result import made_result


@pytest.fixture(scope="session")
def good():
    return made_result()


@pytest.fixture(scope="session")
def poor():
    return made_result(misfit=0.2, notices=("impact_force: one <odd> sample",))
