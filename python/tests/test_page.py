"""The node of docs/guide/own-imus.md, with replacements of ROS 2."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

import footfall

PAGE = Path(__file__).parents[2] / "docs/guide/own-imus.md"


def test_node_of_the_page_publishes_p_of_each_sample(
    walk: footfall.Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    published: list[float] = []
    callbacks: list[Any] = []

    class Node:
        def create_publisher(self, kind: type, topic: str, depth: int) -> Any:
            assert topic == "/lf_foot/contact/probability"
            return SimpleNamespace(publish=lambda message: published.append(message.data))

        def create_subscription(self, kind: type, topic: str, callback: Any, qos: str) -> None:
            assert (topic, qos) == ("/lf_foot/imu", "sensor data")
            callbacks.append(callback)

    def vector(x: float, y: float, z: float) -> SimpleNamespace:
        return SimpleNamespace(x=float(x), y=float(y), z=float(z))

    samples = range(0, 4000, 2)

    def spin(node: Node) -> None:
        for k in samples:
            micros = round(walk.t[k] * 1e6)
            stamp = SimpleNamespace(sec=micros // 1_000_000, nanosec=micros % 1_000_000 * 1000)
            callbacks[0](
                SimpleNamespace(
                    header=SimpleNamespace(stamp=stamp),
                    linear_acceleration=vector(*walk.acc[k]),
                    angular_velocity=vector(*walk.gyr[k]),
                )
            )

    modules = {
        "rclpy": {"init": lambda: None, "create_node": lambda name: Node(), "spin": spin},
        "rclpy.qos": {"qos_profile_sensor_data": "sensor data"},
        "sensor_msgs": {},
        "sensor_msgs.msg": {"Imu": SimpleNamespace},
        "std_msgs": {},
        "std_msgs.msg": {"Float64": SimpleNamespace},
    }
    for name, content in modules.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    program = PAGE.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    # At the rate of these samples.
    exec(program.replace("rate=400.0", "rate=500.0"), {})
    expected = footfall.estimate(
        walk.acc[samples.start : samples.stop : 2],
        walk.gyr[samples.start : samples.stop : 2],
        walk.t[samples.start : samples.stop : 2],
        rate=500.0,
    )
    assert published == expected.p_stable.tolist()
