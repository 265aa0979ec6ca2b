"""The command line: `fit-parameters` and `vibrojax`. Nothing here imports JAX before a command has work to do."""
