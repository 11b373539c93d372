"""The five nodes for installations with launch_ros; scripts/run_graph.sh needs none."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

CAMERA = (
    ("rgb/image_rect_color", "color", "/rgb/image_rect_color"),
    ("depth_registered/image_rect", "depth", "/depth_registered/image_rect"),
    ("rgb/camera_info", "info", "/rgb/camera_info"),
)


def generate_launch_description() -> LaunchDescription:
    """Return the graph; the camera's topics and the object database are arguments."""
    models = ParameterValue(LaunchConfiguration("models"), value_type=str)
    camera = [(topic, LaunchConfiguration(name)) for topic, name, _ in CAMERA]
    robot = [
        ("imitation/robot_objects", LaunchConfiguration("robot_objects")),
        ("imitation/robot_shapes", LaunchConfiguration("robot_shapes")),
    ]
    nodes = (
        ("intent_perception", "recognizer", camera),
        ("intent_tracking", "tracker", camera),
        ("intent_tracking", "grasp_detector", []),
        ("intent_inference", "inference", []),
        ("intent_imitation", "imitation", robot),
    )
    return LaunchDescription(
        [
            *(DeclareLaunchArgument(name, default_value=topic) for _, name, topic in CAMERA),
            DeclareLaunchArgument("models", default_value="", description="object database"),
            DeclareLaunchArgument("robot_objects", default_value="/intent/objects"),
            DeclareLaunchArgument("robot_shapes", default_value="/intent/shapes"),
            *(
                Node(
                    package=package,
                    executable=executable,
                    parameters=[{"models": models}],
                    remappings=remappings,
                    output="screen",
                )
                for package, executable, remappings in nodes
            ),
        ]
    )
