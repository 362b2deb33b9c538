"""Which renderer draws bodies on this machine: VTK (through PyVista) wherever it can, else matplotlib.

VTK's wheels carry no OpenGL: they load EGL, OSMesa or X from the system when the first window is
made, and where none is there the process dies with a segmentation fault instead of an error. So a
child process tries first. The fall-back draws the same pictures; only shading in space is lost.
"""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from dataclasses import dataclass

WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
PROBE = """
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a crash is expected here: no core file
except ImportError:
    pass
from vtkmodules import vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(8, 8)
renderer = vtkRenderer()
renderer.SetBackground(1, 0, 0)
window.AddRenderer(renderer)
window.Render()
shot = vtkWindowToImageFilter()
shot.SetInput(window)
shot.Update()
pixel = [shot.GetOutput().GetScalarComponentAsDouble(4, 4, 0, i) for i in range(3)]
print("drawn" if pixel == [255, 0, 0] else "blank", window.GetClassName())
"""


@dataclass(frozen=True)
class Backend:
    """`name` is "vtk" or "matplotlib"; `notice` says in a sentence why it is not VTK, else "" ."""

    name: str
    window: str = ""
    notice: str = ""


def _try(window: str | None) -> str | None:
    """Class of the window that a child process could draw with; None when it could not."""
    environment = dict(os.environ)
    if window is not None:
        environment[WINDOW] = window
    try:
        done = subprocess.run([sys.executable, "-c", PROBE], env=environment, capture_output=True, text=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    words = done.stdout.split()
    return words[1] if done.returncode == 0 and words[:1] == ["drawn"] else None


@functools.cache
def choose() -> Backend:
    """Tries once per process. Sets VTK's window class, so that it does not first look for a display."""
    try:
        import importlib.util

        if importlib.util.find_spec("pyvista") is None:
            return Backend("matplotlib", notice="pyvista is not installed; matplotlib draws the pictures")
    except ImportError:
        return Backend("matplotlib", notice="pyvista cannot be found; matplotlib draws the pictures")
    headless = sys.platform.startswith("linux") and not os.environ.get("DISPLAY")
    tries = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow") if headless else (None,)
    if WINDOW in os.environ:  # the user knows
        tries = (None,)
    for window in tries:
        found = _try(window)
        if found is not None:
            if window is not None:
                os.environ[WINDOW] = window
            return Backend("vtk", found)
    return Backend(
        "matplotlib",
        notice="VTK finds no OpenGL here (no EGL, no OSMesa, no display); matplotlib draws the pictures instead",
    )
