"""The ROS package of clearway: entry points, launch files, parameters."""

from glob import glob

from setuptools import setup

NAME = "clearway_ros"
SHARE = f"share/{NAME}"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        (f"{SHARE}/launch", glob("launch/*.launch.py")),
        (f"{SHARE}/config", glob("config/*")),
    ],
    install_requires=["setuptools"],
    maintainer="The clearway project",
    maintainer_email="maintainer@example.org",
    description="The nodes of clearway",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            f"clearway = {NAME}.nodes:route",
            f"guard = {NAME}.nodes:guard",
        ]
    },
)
