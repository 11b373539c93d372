"""Parametric bottles, glasses and mugs: z up, standing on z = 0.

Each maker is one real kind of thing with its own outline; sizes are those of common products [m].
"""

from intent_perception.objects.families.designed_object import (
    DesignedObject,
    turns_about_z,
)
from intent_perception.objects.families.solids import (
    row,
)
from intent_perception.objects.families.vessel_drafts import bottle_draft, glass_draft, mug_draft


def water_bottle() -> DesignedObject:
    """Return a half-litre PET bottle with two grooves and a screw cap."""
    r = 0.0325
    profile = [
        (0.0, 0.024), (0.003, r), (0.050, r), (0.054, r - 0.003), (0.060, r - 0.003),
        (0.064, r), (0.092, r), (0.096, r - 0.003), (0.102, r - 0.003), (0.106, r),
        (0.140, r), (0.166, 0.024), (0.182, 0.0135), (0.188, 0.0135), (0.189, 0.0150),
        (0.206, 0.0150), (0.207, 0.0135),
    ]  # fmt: skip
    return bottle_draft([row(z, x) for z, x in profile], 0.186, 0.140, 0.40, (0.25, 0.55, 0.85))


def wine_bottle() -> DesignedObject:
    """Return a Bordeaux bottle: straight sides, high round shoulders."""
    profile = [
        (0.0, 0.033), (0.004, 0.0375), (0.190, 0.0375), (0.206, 0.0365), (0.222, 0.021),
        (0.235, 0.0145), (0.280, 0.0140), (0.283, 0.0155), (0.297, 0.0155), (0.300, 0.0145),
    ]  # fmt: skip
    return bottle_draft([row(z, x) for z, x in profile], 0.236, 0.196, 0.85, (0.12, 0.30, 0.14))


def beer_bottle() -> DesignedObject:
    """Return a long-neck bottle: short body, long taper."""
    profile = [
        (0.0, 0.027), (0.003, 0.0305), (0.118, 0.0305), (0.135, 0.0285), (0.165, 0.0175),
        (0.205, 0.0135), (0.216, 0.0132), (0.218, 0.0145), (0.228, 0.0145), (0.230, 0.0130),
    ]  # fmt: skip
    return bottle_draft([row(z, x) for z, x in profile], 0.168, 0.120, 0.48, (0.42, 0.24, 0.10))


def sauce_bottle() -> DesignedObject:
    """Return an oval squeeze bottle that narrows to a wide flip cap."""
    profile = [
        (0.0, 0.030, 0.021), (0.004, 0.036, 0.027), (0.070, 0.037, 0.028),
        (0.115, 0.031, 0.024), (0.148, 0.020, 0.018), (0.152, 0.0185, 0.0175),
        (0.153, 0.021, 0.021), (0.178, 0.0185, 0.0185), (0.180, 0.0165, 0.0165),
    ]  # fmt: skip
    rows = [row(z, x, y, 2.3 if z < 0.15 else 2.0) for z, x, y in profile]
    return bottle_draft(rows, 0.152, 0.112, 0.42, (0.80, 0.12, 0.10), turns_about_z(2))


def milk_bottle() -> DesignedObject:
    """Return a square juice bottle with a wide neck."""
    profile = [
        (0.0, 0.032, 5.0), (0.004, 0.0365, 5.0), (0.135, 0.0365, 5.0), (0.160, 0.034, 4.0),
        (0.192, 0.020, 2.2), (0.200, 0.0185, 2.0), (0.203, 0.0185, 2.0), (0.204, 0.0205, 2.0),
        (0.220, 0.0205, 2.0), (0.221, 0.019, 2.0),
    ]  # fmt: skip
    rows = [row(z, x, x, p) for z, x, p in profile]
    return bottle_draft(rows, 0.201, 0.140, 0.55, (0.92, 0.88, 0.76), turns_about_z(4))


def soap_bottle() -> DesignedObject:
    """Return a flat dish-soap bottle with a waist and a spout."""
    profile = [
        (0.0, 0.040, 0.024), (0.004, 0.044, 0.028), (0.060, 0.043, 0.028),
        (0.110, 0.033, 0.024), (0.150, 0.038, 0.026), (0.178, 0.030, 0.022),
        (0.192, 0.015, 0.014), (0.196, 0.013, 0.013), (0.214, 0.012, 0.012),
        (0.216, 0.007, 0.007), (0.234, 0.005, 0.005),
    ]  # fmt: skip
    rows = [row(z, x, y, 2.4 if z < 0.18 else 2.0) for z, x, y in profile]
    return bottle_draft(rows, 0.194, 0.165, 0.50, (0.20, 0.75, 0.35), turns_about_z(2))


def cola_bottle() -> DesignedObject:
    """Return a contour bottle: waist, bulge and long neck."""
    profile = [
        (0.0, 0.026), (0.003, 0.0295), (0.040, 0.0290), (0.070, 0.0245), (0.095, 0.0270),
        (0.128, 0.0310), (0.160, 0.0230), (0.196, 0.0135), (0.222, 0.0125), (0.224, 0.0140),
        (0.234, 0.0140), (0.236, 0.0130),
    ]  # fmt: skip
    return bottle_draft([row(z, x) for z, x in profile], 0.190, 0.132, 0.44, (0.35, 0.10, 0.12))


def medicine_bottle() -> DesignedObject:
    """Return a squat jar-like bottle with a ribbed wide cap."""
    r = 0.034
    profile = [
        (0.0, 0.031), (0.003, r), (0.078, r), (0.092, 0.029), (0.098, 0.0215), (0.101, 0.0215),
        (0.102, 0.0235), (0.124, 0.0235), (0.126, 0.0215),
    ]  # fmt: skip
    return bottle_draft([row(z, x) for z, x in profile], 0.100, 0.080, 0.24, (0.85, 0.55, 0.15))


def tumbler() -> DesignedObject:
    """Return a straight water glass."""
    rows = [row(0.0, 0.034), row(0.003, 0.0375), row(0.050, 0.038), row(0.095, 0.039)]
    return glass_draft(rows, 0.0025, 0.008, 0.22, (0.62, 0.80, 0.88))


def highball() -> DesignedObject:
    """Return a tall narrow glass with a thick floor."""
    rows = [row(0.0, 0.027), row(0.003, 0.030), row(0.080, 0.0305), row(0.152, 0.0315)]
    return glass_draft(rows, 0.0025, 0.014, 0.27, (0.55, 0.85, 0.75))


def pint() -> DesignedObject:
    """Return a tapered beer glass."""
    rows = [row(0.0, 0.0275), row(0.002, 0.0300), row(0.070, 0.0365), row(0.149, 0.0440)]
    return glass_draft(rows, 0.003, 0.010, 0.34, (0.90, 0.75, 0.35))


def whisky_glass() -> DesignedObject:
    """Return a low, heavy, rounded square glass."""
    rows = [row(z, x, x, 4.0) for z, x in ((0.0, 0.033), (0.003, 0.036), (0.088, 0.040))]
    return glass_draft(rows, 0.0045, 0.016, 0.33, (0.75, 0.72, 0.90), symmetry=turns_about_z(4))


def tulip_glass() -> DesignedObject:
    """Return a bellied glass on a short foot."""
    profile = [
        (0.0, 0.033), (0.004, 0.034), (0.009, 0.024), (0.018, 0.019), (0.030, 0.026),
        (0.075, 0.041), (0.105, 0.041), (0.135, 0.033), (0.156, 0.034),
    ]  # fmt: skip
    return glass_draft([row(z, x) for z, x in profile], 0.0025, 0.026, 0.28, (0.95, 0.60, 0.45))


def bistro_glass() -> DesignedObject:
    """Return a tapered glass with fluted lower half and a round rim."""
    profile = [
        (0.0, 0.024, 0.0012), (0.003, 0.027, 0.0012), (0.050, 0.036, 0.0012),
        (0.060, 0.038, 0.0), (0.062, 0.0395, 0.0), (0.090, 0.0430, 0.0),
    ]  # fmt: skip
    rows = [row(z, x, flute=depth) for z, x, depth in profile]
    return glass_draft(rows, 0.0035, 0.009, 0.23, (0.45, 0.70, 0.45), lobes=12)


def wine_glass() -> DesignedObject:
    """Return a stemmed glass: foot, stem, bowl."""
    profile = [
        (0.0, 0.034), (0.003, 0.0345), (0.006, 0.020), (0.012, 0.0050), (0.050, 0.0042),
        (0.082, 0.0050), (0.090, 0.014), (0.104, 0.033), (0.132, 0.0415), (0.165, 0.0395),
        (0.198, 0.0330),
    ]  # fmt: skip
    return glass_draft([row(z, x) for z, x in profile], 0.0022, 0.096, 0.19, (0.80, 0.40, 0.60))


def juice_glass() -> DesignedObject:
    """Return a small conical glass."""
    rows = [row(0.0, 0.020), row(0.002, 0.0225), row(0.045, 0.0285), row(0.090, 0.0335)]
    return glass_draft(rows, 0.0025, 0.007, 0.14, (0.98, 0.85, 0.60))


def standard_mug() -> DesignedObject:
    """Return the usual coffee mug."""
    rows = [row(0.0, 0.037), row(0.003, 0.0405), row(0.050, 0.041), row(0.096, 0.041)]
    return mug_draft(rows, 0.004, 0.33, (0.20, 0.35, 0.75), 0.018, 0.080, 0.031, 0.0045, 0.0085)


def latte_mug() -> DesignedObject:
    """Return a tall conical mug with an ear at the top."""
    rows = [row(0.0, 0.028), row(0.003, 0.0305), row(0.060, 0.0365), row(0.122, 0.0435)]
    return mug_draft(
        rows, 0.004, 0.36, (0.85, 0.80, 0.70), 0.044, 0.106, 0.029, 0.0042, 0.0070, 0.9
    )


def small_cup() -> DesignedObject:
    """Return an espresso-like cup with a large ring handle."""
    rows = [row(0.0, 0.021), row(0.003, 0.025), row(0.022, 0.0315), row(0.063, 0.0335)]
    return mug_draft(
        rows, 0.0038, 0.19, (0.75, 0.20, 0.20), 0.018, 0.056, 0.028, 0.0038, 0.0065, 0.9
    )


def barrel_mug() -> DesignedObject:
    """Return a bellied mug."""
    profile = [(0.0, 0.031), (0.003, 0.034), (0.030, 0.0455), (0.060, 0.0465), (0.092, 0.038)]
    rows = [row(z, x) for z, x in profile]
    return mug_draft(rows, 0.0045, 0.38, (0.35, 0.60, 0.45), 0.020, 0.078, 0.031, 0.0050, 0.0090)


def camping_mug() -> DesignedObject:
    """Return a wide, low enamel mug with a flat strap handle."""
    rows = [row(0.0, 0.041), row(0.003, 0.0435), row(0.040, 0.0440), row(0.078, 0.0450)]
    return mug_draft(
        rows, 0.0030, 0.17, (0.92, 0.92, 0.94), 0.014, 0.068, 0.033, 0.0025, 0.0090, 0.6
    )


def beer_mug() -> DesignedObject:
    """Return a tall stein with a heavy square handle."""
    rows = [row(0.0, 0.040), row(0.004, 0.044), row(0.020, 0.041), row(0.134, 0.039)]
    return mug_draft(
        rows, 0.0050, 0.62, (0.55, 0.45, 0.35), 0.024, 0.116, 0.037, 0.0065, 0.0095, 0.45
    )


def cappuccino_cup() -> DesignedObject:
    """Return a wide round-bottomed cup."""
    profile = [
        (0.0, 0.026), (0.003, 0.027), (0.008, 0.030), (0.026, 0.0455), (0.046, 0.0515),
        (0.070, 0.0535),
    ]  # fmt: skip
    rows = [row(z, x) for z, x in profile]
    return mug_draft(
        rows, 0.0042, 0.30, (0.45, 0.28, 0.20), 0.026, 0.064, 0.028, 0.0040, 0.0070, 0.8
    )


def square_mug() -> DesignedObject:
    """Return a mug of rounded square section."""
    rows = [row(z, x, x, 4.5) for z, x in ((0.0, 0.034), (0.003, 0.037), (0.100, 0.0385))]
    return mug_draft(
        rows, 0.0045, 0.40, (0.95, 0.65, 0.20), 0.016, 0.086, 0.032, 0.0050, 0.0080, 0.5
    )


BOTTLES = (
    water_bottle, wine_bottle, beer_bottle, sauce_bottle,
    milk_bottle, soap_bottle, cola_bottle, medicine_bottle,
)  # fmt: skip
GLASSES = (
    tumbler, highball, pint, whisky_glass, tulip_glass, bistro_glass, wine_glass, juice_glass,
)  # fmt: skip
MUGS = (
    standard_mug, latte_mug, small_cup, barrel_mug,
    camping_mug, beer_mug, cappuccino_cup, square_mug,
)  # fmt: skip
