from pathlib import Path

from setuptools import find_packages, setup

package_name = "intent_inference"


def files(folder: str) -> list[str]:
    """Return the files of a folder beside this one, relative to it; none where it is absent."""
    return sorted(str(path) for path in Path(folder).glob("*") if path.is_file())


setup(
    name=package_name,
    version="0.1.0",
    packages=find_packages(include=[package_name, f"{package_name}.*"]),
    # Shipped artefacts (object database, models, grasp libraries) travel inside the module.
    package_data={package_name: ["py.typed", "share/*", "share/**/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{package_name}"]),
        (f"share/{package_name}", ["package.xml"]),
        *(
            (f"share/{package_name}/{d}", files(d))
            for d in ("config", "launch", "rviz")
            if files(d)
        ),
    ],
    zip_safe=False,
    maintainer="Intent maintainers",
    maintainer_email="maintainers@intent.invalid",
    description="Infers the task a person intends from a grasp, with Bayesian networks",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "inference = intent_inference.ros.inference_nodes:inference",
            "record = intent_inference.ros.inference_nodes:record",
        ],
    },
)
