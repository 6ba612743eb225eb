"""Drawing: the only module that imports pyvista, run as a child process so that a missing display cannot hurt a repair.

    python -m patchwright.pipelines.view SCENES.npz

The archive is made by `scenes.draw_listing`; every scene and every sheet of charts in it becomes one PNG file.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

SIZE = (1400, 900)
DIRECTION = (-1.0, -1.6, 0.9)  # from the model to the eye
MARGIN = 1.12
BAR = {
    "title_font_size": 18,
    "label_font_size": 15,
    "width": 0.4,
    "height": 0.07,
    "position_x": 0.3,
    "position_y": 0.03,
}
BACKGROUND = "#ffffff"


def draw_scene(scene: dict[str, Any], arrays: dict[str, Any], path: Path) -> None:
    """Draw one scene off-screen and write it as PNG (beside, then renamed)."""
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True, window_size=list(scene.get("size", SIZE)))
    plotter.set_background(BACKGROUND)
    plotter.enable_anti_aliasing("fxaa")
    for layer in scene["layers"]:
        _add(plotter, pv, layer, arrays)
    if scene.get("title"):
        plotter.add_text(scene["title"], font_size=11, color="#222222", position="upper_left")
    _aim(plotter, scene)
    beside = path.with_name(f".{path.name}.tmp.png")
    plotter.screenshot(str(beside))
    plotter.close()
    beside.replace(path)


def draw_charts(sheet: dict[str, Any], arrays: dict[str, Any], path: Path) -> None:
    """Draw a sheet of charts off-screen and write it as PNG (beside, then renamed)."""
    import pyvista as pv

    columns, (width, height) = sheet["columns"], sheet["size"]
    rows = -(-len(sheet["charts"]) // columns)
    plotter = pv.Plotter(off_screen=True, window_size=[columns * width, rows * height])
    plotter.set_background(BACKGROUND)
    for i, chart in enumerate(sheet["charts"]):
        row, column = divmod(i, columns)
        axes = pv.Chart2D(
            size=(1.0 / columns, 1.0 / rows),
            loc=(column / columns, 1.0 - (row + 1) / rows),
            x_label=chart["labels"][0],
            y_label=chart["labels"][1],
            grid=False,
        )
        axes.title, axes.border_color = chart["title"], BACKGROUND
        axes.legend_visible = chart["legend"]
        for layer in chart["layers"]:
            x, y = arrays[layer["key"]].T
            if layer["kind"] == "line":
                axes.line(x, y, layer["colour"], layer["width"], layer["style"], layer["label"])
            elif layer["kind"] == "dots":
                axes.scatter(x, y, layer["colour"], layer["size"], "o", layer["label"])
            else:
                axes.bar(x, y, layer["colour"])
                axes.x_axis.tick_locations, axes.x_axis.tick_labels = list(x), layer["names"]
        axes.x_range, axes.y_range = chart["ranges"]
        plotter.add_chart(axes)
    beside = path.with_name(f".{path.name}.tmp.png")
    plotter.screenshot(str(beside))
    plotter.close()
    beside.replace(path)


def _aim(plotter: Any, scene: dict[str, Any]) -> None:
    """Parallel projection along the scene's direction, the box filling the picture."""
    towards = np.asarray(scene.get("direction", DIRECTION), dtype=np.float64)
    towards /= np.linalg.norm(towards)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    low, high = np.asarray(scene["box"], dtype=np.float64)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    centre = (low + high) / 2.0
    width, height = (float(np.ptp((corners - centre) @ axis)) for axis in (right, up))
    reach = max(float(np.linalg.norm(high - low)), 1e-300)
    plotter.camera.focal_point = centre
    plotter.camera.position = centre + 3.0 * reach * towards
    plotter.camera.up = up
    plotter.camera.parallel_projection = True
    aspect = scene.get("size", SIZE)[0] / scene.get("size", SIZE)[1]
    plotter.camera.parallel_scale = max(0.5 * MARGIN * max(height, width / aspect), 1e-300)
    plotter.camera.clipping_range = (1e-3 * reach, 10.0 * reach)


def _add(plotter: Any, pv: Any, layer: dict[str, Any], arrays: dict[str, Any]) -> None:
    kind, key = layer["kind"], layer["key"]
    if kind == "surface":
        triangles = arrays[f"{key}.triangles"]
        faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
        mesh = pv.PolyData(arrays[f"{key}.vertices"], faces)
        options: dict[str, Any] = {"smooth_shading": False, "ambient": 0.25, "diffuse": 0.75, "specular": 0.1}
        if f"{key}.values" in arrays:
            mesh.cell_data["values"] = arrays[f"{key}.values"]
            bar = {"title": layer.get("bar", "") + "\n", "color": "#222222", "n_labels": 5, "fmt": "%.1e", **BAR}
            plotter.add_mesh(
                mesh, scalars="values", cmap="viridis", clim=layer.get("range"), scalar_bar_args=bar, **options
            )
        elif f"{key}.colours" in arrays:
            mesh.cell_data["rgb"] = arrays[f"{key}.colours"]
            plotter.add_mesh(mesh, scalars="rgb", rgb=True, **options)
        else:
            plotter.add_mesh(
                mesh,
                color=layer.get("colour", "#b8c4d0"),
                show_edges=layer.get("edges", False),
                edge_color="#5a6672",
                line_width=0.5,
                **options,
            )
    elif kind == "lines":
        points = arrays[f"{key}.points"]
        if len(points):
            cells = np.column_stack([np.full(len(points) // 2, 2), np.arange(len(points)).reshape(-1, 2)]).ravel()
            mesh = pv.PolyData(points, lines=cells)
            plotter.add_mesh(
                mesh,
                color=layer.get("colour", "#c03030"),
                line_width=layer.get("width", 2.0),
                render_lines_as_tubes=layer.get("tubes", False),
                lighting=False,
            )
    elif kind == "points":
        points = arrays[f"{key}.points"]
        if len(points):
            plotter.add_points(
                points,
                color=layer.get("colour", "#c03030"),
                point_size=layer.get("width", 9.0),
                render_points_as_spheres=True,
            )


def main(archive: str) -> int:
    """Draw every scene of an archive."""
    with np.load(archive) as data:
        arrays = {key: data[key] for key in data.files}
    for scene in json.loads(str(arrays.pop("scenes"))):
        draw = draw_charts if "charts" in scene else draw_scene
        draw(scene, arrays, Path(scene["path"]))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
