"""The topics of a bag: the aligned depth of one camera, whatever the driver calls it."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from intent_perception.bags.bag_topics import (
    COMPRESSED,
    IMAGE,
    INFO,
    ImageTopics,
    chosen_topics,
    holds_depth,
)

REALSENSE = {
    "/camera/camera/color/image_raw": IMAGE,
    "/camera/camera/color/camera_info": INFO,
    "/camera/camera/depth/image_rect_raw": IMAGE,
    "/camera/camera/depth/camera_info": INFO,
    "/camera/camera/aligned_depth_to_color/image_raw": IMAGE,
    "/camera/camera/aligned_depth_to_color/camera_info": INFO,
    "/camera/camera/infra1/image_rect_raw": IMAGE,
    "/camera/camera/infra1/camera_info": INFO,
}
KINECT4 = {
    "/rgb/image_raw": IMAGE,
    "/rgb/camera_info": INFO,
    "/depth/image_raw": IMAGE,
    "/depth/camera_info": INFO,
    "/depth_to_rgb/image_raw": IMAGE,
    "/depth_to_rgb/camera_info": INFO,
    "/ir/image_raw": IMAGE,
    "/ir/camera_info": INFO,
}
OPENNI = {
    "/camera/rgb/image_rect_color": IMAGE,
    "/camera/rgb/camera_info": INFO,
    "/camera/depth/image_rect_raw": IMAGE,
    "/camera/depth_registered/image_raw": IMAGE,
    "/camera/depth_registered/camera_info": INFO,
    "/camera/rgb/debug_overlay": IMAGE,
}
OAK = {
    "/oak/rgb/image_raw": IMAGE,
    "/oak/rgb/camera_info": INFO,
    "/oak/stereo/image_raw": IMAGE,
    "/oak/stereo/camera_info": INFO,
}


@pytest.mark.parametrize(
    ("types", "depth", "expected"),
    [
        (
            REALSENSE,
            {
                "/camera/camera/depth/image_rect_raw",
                "/camera/camera/aligned_depth_to_color/image_raw",
                "/camera/camera/infra1/image_rect_raw",  # mono16
            },
            ImageTopics(
                "/camera/camera/color/image_raw",
                "/camera/camera/aligned_depth_to_color/image_raw",
                "/camera/camera/color/camera_info",
            ),
        ),
        (
            KINECT4,
            {"/depth/image_raw", "/depth_to_rgb/image_raw", "/ir/image_raw"},
            ImageTopics("/rgb/image_raw", "/depth_to_rgb/image_raw", "/rgb/camera_info"),
        ),
        (
            OPENNI,
            {"/camera/depth/image_rect_raw", "/camera/depth_registered/image_raw"},
            ImageTopics(
                "/camera/rgb/image_rect_color",
                "/camera/depth_registered/image_raw",
                "/camera/rgb/camera_info",
            ),
        ),
        (
            OAK,
            {"/oak/stereo/image_raw"},
            ImageTopics("/oak/rgb/image_raw", "/oak/stereo/image_raw", "/oak/rgb/camera_info"),
        ),
    ],
    ids=["RealSense", "Azure Kinect", "OpenNI", "OAK-D"],
)
def test_the_topics_of_a_driver_are_found(
    types: dict[str, str], depth: set[str], expected: ImageTopics
) -> None:
    assert chosen_topics("bag", types, depth, ()) == expected


def two_cameras() -> tuple[dict[str, str], set[str]]:
    types = {
        f"/{name}/{topic}": kind
        for name in ("left", "right")
        for topic, kind in (
            ("color/image_raw", IMAGE),
            ("color/camera_info", INFO),
            ("aligned_depth_to_color/image_raw", IMAGE),
        )
    }
    return types, {f"/{name}/aligned_depth_to_color/image_raw" for name in ("left", "right")}


def test_two_cameras_are_an_error_that_lists_them() -> None:
    types, depth = two_cameras()
    with pytest.raises(ValueError, match=r"several cameras: choose one by --topics.*/left/color/"):
        chosen_topics("bag", types, depth, ())


def test_of_two_cameras_the_one_with_aligned_depth_is_taken_whole() -> None:
    types, depth = two_cameras()
    types["/left/depth/image_raw"] = types.pop("/left/aligned_depth_to_color/image_raw")
    depth = {"/left/depth/image_raw", "/right/aligned_depth_to_color/image_raw"}
    found = chosen_topics("bag", types, depth, ())
    assert {topic.split("/")[1] for topic in (found.color, found.depth, found.info)} == {"right"}


def test_named_topics_are_taken_and_wrong_ones_refused() -> None:
    types, depth = two_cameras()
    named = (
        "/left/color/image_raw",
        "/left/aligned_depth_to_color/image_raw",
        "/left/color/camera_info",
    )
    assert chosen_topics("bag", types, depth, named) == ImageTopics(*named)
    with pytest.raises(ValueError, match=r"expected --topics COLOR DEPTH INFO.*got /middle"):
        chosen_topics("bag", types, depth, ("/middle", *named[1:]))
    with pytest.raises(ValueError, match=r"expected /left/color/camera_info of type"):
        chosen_topics("bag", types, depth, (named[2], *named[1:]))


def test_raw_images_are_preferred_to_the_same_compressed() -> None:
    types = {f"{topic}/compressed": COMPRESSED for topic in OAK if "image" in topic} | OAK
    depth = {"/oak/stereo/image_raw", "/oak/stereo/image_raw/compressed"}
    found = chosen_topics("bag", types, depth, ())
    assert (found.color, found.depth) == ("/oak/rgb/image_raw", "/oak/stereo/image_raw")


def test_depth_is_known_by_what_its_messages_hold() -> None:
    raw = SimpleNamespace(encoding="16UC1")
    png = cv2.imencode(".png", np.ones((4, 4), np.uint16))[1].tobytes()
    picture = cv2.imencode(".png", np.ones((4, 4, 3), np.uint8))[1].tobytes()
    assert holds_depth("/oak/stereo/image_raw", IMAGE, raw)
    assert not holds_depth("/depth_colored", IMAGE, SimpleNamespace(encoding="bgr8"))
    coded = SimpleNamespace(format="png", data=png)
    assert holds_depth("/stereo/image_raw/compressed", COMPRESSED, coded)
    colored = SimpleNamespace(format="png", data=picture)
    assert not holds_depth("/rgb/image_raw/compressed", COMPRESSED, colored)
