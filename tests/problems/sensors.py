"""Sensors in 3D, pressed and slid without inertia by a plate of which the body's answers are computed once."""

import fingerslip as fs
from fingerslip.dynamics.statics.body import static_body
from fingerslip.dynamics.statics.motion import static_motion


def pressed_sensor(sensor, mesh, friction, programme, *, step, reach=None):
    """Return a sensor in 3D that a plate moves in steps [s], with its internal markers."""
    plane = fs.Plane((0.0, 1.0, 0.0))
    contact = fs.Contact("contact", plane, friction, normal_penalty=5e9, tangential_penalty=5e9, search_distance=reach)
    return fs.Model(
        mesh=mesh,
        materials=sensor.materials,
        formulation="solid",
        depth=1.0,
        supports=sensor.supports(3),
        integration="nodal",
        contacts=(contact,),
        time=fs.QuasiStatic(step),
        record=fs.Recording(sites=sensor.sites(("internal_markers",), 3)),
        programme=tuple(programme),
    )


def slid_sensor(sensor, mesh, friction, programme, *, step, reach, hidden, patch):
    """Return the internal markers of a sensor, and their motion in steps [s]; the rest as for `static_body`."""
    model = pressed_sensor(sensor, mesh, friction, programme, step=step, reach=reach)
    body = static_body(model, reach=reach, hidden=hidden, patch=patch)
    return model.record.sites, static_motion(body, model.contacts[0], model.programme, step)
