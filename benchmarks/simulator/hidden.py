"""What a rig conceals: everything that acts in an experiment and that its description does not say."""

import dataclasses
from collections.abc import Mapping, Sequence

from benchmarks.simulator.faults import Fault


@dataclasses.dataclass(frozen=True, kw_only=True)
class Hidden:
    """Physics as parameters of the kernel, and faults of channels."""

    motion: Mapping[str, float] = dataclasses.field(default_factory=dict)
    """In every motion of the rig."""
    records: Mapping[str, Mapping[str, float]] = dataclasses.field(default_factory=dict)
    """In single records of the experiment, by file; never in the sealed ones."""
    faults: tuple[Fault, ...] = ()
    law: str | None = None
    """The contact law that the experiment declares, if not the usual one."""

    def parameters(self, file: str) -> dict[str, float]:
        """All that acts on the motion in one record."""
        return {**self.motion, **self.records.get(file, {})}

    def numbers(self) -> dict:
        """The same as plain data, without what is empty."""
        faults = [{"kind": type(fault).__name__} | dataclasses.asdict(fault) for fault in self.faults]  # type: ignore[call-overload]
        all_of_it = {"motion": dict(self.motion), "records": dict(self.records), "faults": faults, "law": self.law}
        return {name: value for name, value in all_of_it.items() if value}


NOTHING = Hidden()


def together(parts: Sequence[Hidden]) -> Hidden:
    """Several effects in one rig; two that would set the same number are refused."""
    motion: dict[str, float] = {}
    records: dict[str, dict[str, float]] = {}
    for part in parts:
        for where, new in [(motion, part.motion)] + [(records.setdefault(file, {}), values) for file, values in part.records.items()]:
            if shared := set(where) & set(new):
                raise ValueError(f"two effects set {sorted(shared)}: choose effects that differ in their parameters")
            where |= new
    laws = [part.law for part in parts if part.law]
    faults = tuple(fault for part in parts for fault in part.faults)
    return Hidden(motion=motion, records=records, faults=faults, law=laws[0] if laws else None)
