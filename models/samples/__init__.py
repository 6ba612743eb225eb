"""Demonstration shapes made in code, with known truth, and injectors of labelled defects.

Shapes return a `Sample`: clean parts, NURBS surfaces, `Truth`. Injectors take a triangulation and return a `Damaged`;
`damage` chains them. `demo_aircraft` and `eight_defects` are ready-made dirty cases.
"""

from patchwright.models.samples.aircraft import aircraft
from patchwright.models.samples.blade import blade
from patchwright.models.samples.body import Body
from patchwright.models.samples.car import car
from patchwright.models.samples.crossing import crossing
from patchwright.models.samples.cube_sphere import cube_sphere_patches
from patchwright.models.samples.cutting import push_apart, slit
from patchwright.models.samples.defects import Damaged, Injected, Injector, damage
from patchwright.models.samples.demo import DirtySample, demo_aircraft
from patchwright.models.samples.eight import DefectCase, eight_defects
from patchwright.models.samples.flap import slotted_flap
from patchwright.models.samples.parametrisation import poor_parametrisation, uneven_knots
from patchwright.models.samples.sample import Sample
from patchwright.models.samples.simple import capsule, cube, ellipsoid, sphere, torus, two_spheres
from patchwright.models.samples.soup import debris, duplicated, flipped, missing_triangles, unmerged
from patchwright.models.samples.splitting import degenerate, needles, t_junctions
from patchwright.models.samples.truth import SurfacePoints, Truth
from patchwright.models.samples.wavy import wavy_patch

__all__ = [
    "Body",
    "Damaged",
    "DefectCase",
    "DirtySample",
    "Injected",
    "Injector",
    "Sample",
    "SurfacePoints",
    "Truth",
    "aircraft",
    "blade",
    "capsule",
    "car",
    "crossing",
    "cube",
    "cube_sphere_patches",
    "damage",
    "debris",
    "degenerate",
    "demo_aircraft",
    "duplicated",
    "eight_defects",
    "ellipsoid",
    "flipped",
    "missing_triangles",
    "needles",
    "poor_parametrisation",
    "push_apart",
    "slit",
    "slotted_flap",
    "sphere",
    "t_junctions",
    "torus",
    "two_spheres",
    "uneven_knots",
    "unmerged",
    "wavy_patch",
]
