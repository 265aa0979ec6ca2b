"""What is known of each recording from its authors or from other tests, which the program is not told."""

import dataclasses
from collections.abc import Set


@dataclasses.dataclass(frozen=True, kw_only=True)
class Known:
    """One recipe, and what there is to find in it.

    Attributes:
        recipe: name in `data/recipes`.
        question: that the diagnosis is asked.
        truth: what is known, and from where.
        expected: groups of effects; to agree, a diagnosis must name one of each. Empty where what is known is on no list.
        cannot: what these records do not identify.
    """

    recipe: str
    question: str
    truth: str
    expected: tuple[tuple[str, ...], ...]
    cannot: str

    def agreement(self, named: set[str], stated: Set[str] = frozenset()) -> str:
        """Whether what was named is what is known: "yes", "in part", "no", "abstained" (no name) or "not on the list".

        "Beside others" is added where effects are named that are not known. Where no listed effect stands for what is known, no name is
        right or wrong. Of a diagnosis that asserts none, effects `stated` to explain a part of the misfit are compared in the same way.

        Example:
            >>> one = Known(recipe="r", question="", truth="", expected=(("a", "b"), ("c",)), cannot="")
            >>> one.agreement({"b", "c"}), one.agreement({"b", "c", "x"}), one.agreement({"a", "x"}), one.agreement(set())
            ('yes', 'yes, beside others', 'in part, beside others', 'abstained')
            >>> one.agreement(set(), {"b"}), one.agreement(set(), {"x"})
            ('abstained; stated: in part', 'abstained; stated: no')
        """
        if not self.expected:
            return "not on the list"
        hit = [bool(named & set(group)) for group in self.expected]
        if not any(hit):
            if named:
                return "no"
            return f"abstained; stated: {self.agreement({*stated})}" if stated else "abstained"
        others = named - {name for group in self.expected for name in group}
        return ("yes" if all(hit) else "in part") + (", beside others" if others else "")


_SPRING = "voice coil, commanded as a spring of 15 N/mm"
KNOWN = (
    Known(
        recipe="friction_backlash",
        question="A spring and a damper are fitted to the force of a friction damper. What do they leave out?",
        truth="dry friction of some 9 to 12 kN (2.0 to 2.6 kip), which is gone over some 4 mm after a reversal (play in the linkage)",
        expected=(("coulomb_friction", "hysteresis"),),
        cannot="Whether the way from one sliding force to the other is play or elastic: both draw the same loop.",
    ),
    Known(
        recipe="multiarm_pendulum",
        question="An arm on ball bearings swings freely; viscous damping is fitted, as its authors did. What brakes it besides?",
        truth="dry friction stops the small swings, air drag brakes the large ones",
        expected=(("coulomb_friction",), ("quadratic_drag",)),
        cannot="How much of the drag is the air's and how much the bearing's: the authors measured neither alone.",
    ),
    Known(
        recipe="free_swing",
        question="The arm of a rotary pendulum swings freely; viscous damping is fitted, as its author did. What brakes it besides?",
        truth="the decay becomes linear and the arm stops: dry friction of the bearing",
        expected=(("coulomb_friction",),),
        cannot="How the friction depends on the load of the bearing, which changes with the arm's speed.",
    ),
    Known(
        recipe="torque_pendulum",
        question="A motor swings a pendulum up; viscous damping is fitted. What brakes it besides?",
        truth="friction of the drive that grows less than in proportion to the speed, such as dry friction",
        expected=(("coulomb_friction",),),
        cannot="How the friction depends on the speed: viscous damping less a quadratic part predicts as well as dry friction.",
    ),
    Known(
        recipe="cyberdiver_threshold_5",
        question="A programmed spring is taken for a linear one without an end. Where does its force depart from that?",
        truth=f"{_SPRING} up to 5 N and constant beyond; hard stop at 6.2 mm",
        expected=(("force_saturation",), ("missing_stop",)),
        cannot="The stop's stiffness: an impact lasts about ten samples, and the acceleration lags the displacement by one or two.",
    ),
    Known(
        recipe="cyberdiver_threshold_10",
        question="The same with twice the force.",
        truth=f"{_SPRING} up to 10 N and constant beyond; hard stop at 6.2 mm",
        expected=(("force_saturation",), ("missing_stop",)),
        cannot="The stop's stiffness, for the same reason.",
    ),
    Known(
        recipe="cyberdiver_bottom",
        question="A programmed spring that should be linear to the end. Is it?",
        truth=f"{_SPRING}, which the coil cannot follow beyond some 40 N; hard stop at 6.2 mm",
        expected=(("force_saturation",), ("missing_stop",)),
        cannot="What the controller does after it has lost the spring: the runs pass through that in a few milliseconds.",
    ),
    Known(
        recipe="airtrack_collisions",
        question="Hunt-Crossley is fitted to slow and medium collisions with a rubber band. What happens beyond?",
        truth="restitution falls from 0.86 to 0.49 with speed; the fastest two reach something hard 28 mm behind the band",
        expected=(),
        cannot="The hard stop: only held-back collisions reach it.",
    ),
    Known(
        recipe="airtrack_fast",
        question="Hunt-Crossley is fitted to the faster of these collisions, one of the two fastest among them. What does that one reach?",
        truth="the fastest two reach something hard where bare metal ends meet, 28 mm behind the band; the riders shake and pitch",
        expected=(("deep_stop",),),
        cannot="How the riders take up energy: a heavy support and a light mode look like shaking and pitching from afar.",
    ),
    Known(
        recipe="airtrack_rubber",
        question="The same riders at low speed.",
        truth="a stretched rubber band: nearly linear, little loss",
        expected=(),
        cannot="What happens at higher speeds.",
    ),
    Known(
        recipe="airtrack_metal",
        question="The same riders with metal ends. Does one coefficient of restitution describe them?",
        truth="restitution falls from 0.32 at 0.02 m/s to 0.07 at 0.74 m/s (straight lines); impacts last less than two samples",
        expected=(("falling_restitution",),),
        cannot="The law of the contact: the cameras take 500 frames a second.",
    ),
    Known(
        recipe="pcb_shock",
        question="A board on a drop table is taken for one linear mode. What changes from shock to shock?",
        truth="damping grows with amplitude, more modes, drift with shock number",
        expected=(("quadratic_drag",), ("second_mode",)),
        cannot="A force at the board: there is an acceleration on the table and one on the board, and no more.",
    ),
    Known(
        recipe="silverbox",
        question="An electronic oscillator is taken for linear. What is built in besides?",
        truth="a cubic spring",
        expected=(("cubic_stiffness",),),
        cannot="Anything in newtons: input and output are voltages.",
    ),
)
"""In the order of the page."""
