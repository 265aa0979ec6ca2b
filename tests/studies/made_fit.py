"""The folder of a fit, written by hand."""

import json

import numpy as np

from tests.batch.rigs import model
from vibrojax.model_file import write_model

ERRORS = {"k_i": 1e5, "n": 0.01, "zeta": 2e-3}


def written_fit(folder, *, errors=ERRORS, names=("k_i", "n", "zeta"), k_i: float = 1e6, **more: float) -> None:
    """A folder as fit-parameters writes it."""
    write_model(model(), folder / "model.json")
    values = {"k_i": k_i, "n": 1.5, "lambda_i": 0.3, "zeta": 0.02, "f_n": 4.0} | more
    parameters = {name: {"value": value, "stderr": errors.get(name)} for name, value in values.items()}
    matrix = np.eye(len(names)) + 0.9 * (np.eye(len(names), k=1) + np.eye(len(names), k=-1)) * (np.arange(len(names)) < 2)[:, None] * (
        np.arange(len(names)) < 2
    )
    document = {"schema": 1, "parameters": parameters, "correlation": {"names": list(names), "matrix": matrix.tolist()}}
    (folder / "fit.json").write_text(json.dumps(document))
