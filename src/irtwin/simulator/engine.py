"""MuJoCo, imported when it is first asked for something: it is an extra, takes a while, and most commands do without.

`from irtwin.simulator.engine import mujoco` stands for `import mujoco`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import mujoco as mujoco
else:

    class _Mujoco:
        def __getattr__(self, name: str) -> Any:
            import mujoco

            return getattr(mujoco, name)

    mujoco = _Mujoco()
