"""A hand that cannot move or has no thickness is refused by name."""

from pathlib import Path

import pytest

from intent_inference.grasping.urdf import table_from_urdf

(GRIPPER,) = (Path(__file__).parents[2] / "data" / "parallel_gripper").glob("*.urdf")
HAND = """<robot name="hand"><link name="palm"><collision><geometry>
<box size=".1 .1 .02"/></geometry></collision></link>
<link name="finger"><collision><geometry><sphere radius="{radius}"/></geometry></collision></link>
<joint name="bend" type="{kind}"><parent link="palm"/><child link="finger"/>
<axis xyz="{axis}"/><limit lower="{lower}" upper="{upper}"/></joint></robot>"""
GOOD = {"radius": ".01", "kind": "revolute", "axis": "0 1 0", "lower": "0", "upper": "1.5"}


def table(folder: Path, **changes: str) -> object:
    path = folder / "hand.urdf"
    path.write_text(HAND.format(**{**GOOD, **changes}))
    return table_from_urdf(path)


def test_the_hand_of_this_test_is_one(tmp_path: Path) -> None:
    assert table(tmp_path)
    assert table_from_urdf(GRIPPER)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"axis": "0 0 0"}, "'bend' turns about an axis of length zero"),
        ({"axis": "0 nan 0"}, "expected three numbers"),
        ({"radius": "-0.01"}, "link finger: expected a radius above 0"),
        ({"radius": "1e300"}, "link finger: expected a radius"),
        ({"lower": "1.5", "upper": "0"}, "joint bend: expected limits lower <= upper"),
        ({"upper": "inf"}, "joint bend: expected limits"),
        ({"kind": "planar"}, "'bend' is planar"),
    ],
)
def test_impossible_values_are_refused_by_name(
    tmp_path: Path, changes: dict[str, str], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        table(tmp_path, **changes)


def test_entities_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "hand.urdf"
    path.write_text("<!DOCTYPE r [<!ENTITY a 'x'>]>" + HAND.format(**GOOD))
    with pytest.raises(ValueError, match="without a document type"):
        table_from_urdf(path)
