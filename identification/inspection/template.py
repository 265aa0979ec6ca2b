"""A template of an experiment file with every key that the format knows."""

TEMPLATE = """\
# An experiment: one rig, and the records that were made with it. Put the recorded files beside this file.
# Numbers in this file are SI. "# text" is a remark; "#key = value", without a blank, is a setting that is switched off: take the "#" away.

schema = 1 # version of this format

[experiment]
#name = "rig-B, March" # for the report; left out, the folder's name

[hammer]
mass = 0.4 # kg, weighed with everything that moves with it
#estimate_mass = true # mass is a first guess only and is estimated; needs a force channel

# Constant forces on the hammer that are known; left out, there are none. Both are positive towards the stop.
#[rig]
#incline = "5 deg" # of the rail to the horizontal: the hammer is pulled by m g sin(incline) towards a stop that lies downhill
#constant_force = "0.2 N" # a weight on a string, a known preload

[suspension]
kind = "linear" # spring and damper; "pendulum" (wires), "pivot" (bearing, any angle) and "free" (no spring, no damper) are the others
#kind = "pendulum" # instead of the line above
#length = 0.09 # m: length of a pendulum's wires, or radius at which the displacement of a pivot is measured

[contact]
#law = "hunt-crossley" # contact law to fit; this one is taken when nothing is said

# One table for each parameter of which something is to be said: k_i, n, lambda_i, zeta, f_n or a parameter of the chosen law.
#[parameters.n]
#start = 1.5 # first guess, in the parameter's own unit
#fixed = true # hold the parameter at its start
#bounds = [1.2, 1.8] # lowest and highest value of the fit; left out, the usual range
#prior = { mean = 1.5, std = 0.05 } # what is known beside these records: a normal distribution
#varies = true # a value for each record about a common mean; how much they differ is estimated

# One table for each channel that was recorded; leave out what was not. Any channel but the time may be missing.
# unit:  of the recorded numbers, converted on reading: m mm um cm in ft, m/s^2 g, N kN mN lbf kip. A recorder's file that states the
#        unit itself (.tdms, .unv, .uff, .mf4) needs none; where both say it, they must agree.
# sensitivity: of a sensor whose output was recorded, in V, mV or mA, from its calibration sheet: "11.2 mV/N", "100 mV/g", "0.8 V/mm".
#        The unit is then that of the output, left out where it is that of the sensitivity.
# sign: -1 where the sensor is mounted the other way round; its readings are multiplied by it.
# noise: standard deviation of the sensor in SI, whatever the unit; left out, it is estimated from each record.
# range: lowest and highest value in SI that the sensor can show; samples at or beyond it are left out.
# zero: standard deviation in SI of a constant that the channel may be off by; one is then estimated in every record. Left out: none.

[sensors.hammer_displacement] # m, absolute; grows towards the stop
unit = "mm"
#sign = -1
#noise = 1.0e-5 # m
#range = [-0.01, 0.01] # m
#zero = 1.0e-4 # m

[sensors.cart_displacement] # m, absolute; same direction
unit = "mm"

[sensors.impact_force] # N, what the load cell behind the stop reads, positive in compression
unit = "N"

#[sensors.relative_displacement] # m, hammer minus cart, where only their distance was measured
#unit = "mm"

#[sensors.hammer_acceleration] # m/s^2, absolute; same direction as the displacement
#sensitivity = "100 mV/g" # of a file in mV; a file in g or m/s^2 has a unit in its place

#[sensors.cart_acceleration] # m/s^2
#unit = "m/s^2"

#[sensors.applied_force] # N, drives the hammer in records of kind "forced"
#unit = "N"

#[sensors.reaction_force] # N, what suspension and stop resist with in records of kind "prescribed"
#unit = "N"

# One table for each record. Text files hold a header line with the columns' names, or one of units below it, and one line for each sample.
# file: .csv .tsv .txt .lvm (also .gz) .h5 .mat .npz, and with the extra "labdata" .tdms .unv .uff .mf4; relative to this folder
# kind: "drop-test"        cart at rest, hammer released, strikes the stop
#       "cart-excitation"  cart moves as a sine
#       "free-decay"       cart at rest, no contact
#       "forced"           cart at rest, a recorded force drives the hammer (channel applied_force)
#       "prescribed"       the hammer follows a recorded motion, and a force is compared
# gap:  clearance between hammer and stop at rest, m, as it was set; a small setting error is estimated

[[record]]
file = "drop.csv"
kind = "drop-test"
gap = 0.0

[[record]]
file = "cart1.csv"
kind = "cart-excitation"
gap = 0.001
excitation_frequency = 6.25 # Hz, as set; amplitude and phase of the cart are estimated
#base = "measured" # "sine", or "measured" where the recorded cart motion is to drive the model
#held_back = true # never fitted: it is predicted, as a test of the fit
#columns = { time = "t", hammer_displacement = "LVDT 2 [mm]" } # channel = column, where a column does not bear the channel's name
#units = { cart_displacement = "um" } # of the numbers in this file, where neither the file nor the sensor's table is right
#drop_bad_time = true # leave out samples without a time stamp, or with that of the sample before
#crop = [0.2, 2.5] # s, first and last instant that are used, on the file's own clock
#lowpass = 500.0 # Hz: a low-pass without phase on every channel; far above one over the duration of a contact
#decimate = 4 # keep one sample of so many, behind an anti-alias filter
#resample = 2000.0 # Hz, instead of decimate: another rate, or even steps where those of the file are not
#detrend = { hammer_acceleration = "constant" } # take the mean ("constant") or a straight line ("linear") out of a channel
#time_unit = "ms" # of the time column: s, ms, us, min; left out, what the file states, else s
# The following are used by `vibrojax simulate`; a fit estimates them.
#base_amplitude = 0.002 # A0, m
#base_phase = 0.0 # rad: y = A0 sin(2 pi f t + base_phase)
#initial_displacement = -0.003 # m, hammer minus cart
#initial_velocity = 0.0 # m/s, hammer minus cart
#duration = 2.0 # s; with sampling_frequency it takes the place of a file that is not there
#sampling_frequency = 4000.0 # Hz
"""


def template() -> str:
    """Write the template.

    Returns:
        TOML text; it describes two records, whose files must be put beside it.
    """
    return TEMPLATE
