"""How kernels reach the tables: one address instead of forty arrays.

A kernel called from Python receives the addresses of a HEADER and of a WORKSPACE record (layout.py) and opens the
tables it needs. A call then costs the same for two tables as for twenty (an array costs about 50 ns to unpack), and a
record travels between kernels as one pointer. The World object owns every table and keeps it alive while a kernel runs.
"""

from __future__ import annotations

import numpy as np
from numba import carray, types
from numba.extending import intrinsic

from .broad_phase.tables import CELL, GRID, PROXY
from .jit import kernel
from .layout import HEADER, WORKSPACE
from .model import BODY, BODY_STATE, COLLIDER, CONTACT, FIELD, REPORT, REST, TRAITS
from .shape_rows import (
    FACE_ROW,
    HEIGHT_FIELD_ROW,
    HULL_FACE_ROW,
    HULL_ROW,
    MESH_ROW,
    NODE_ROW,
    VERTEX_ROW,
)

_BODY_BYTES = BODY.itemsize
_STATE_BYTES = BODY_STATE.itemsize
_CONTACT_BYTES = CONTACT.itemsize
_PROXY_BYTES = PROXY.itemsize
_CELL_BYTES = CELL.itemsize
_REST_BYTES = REST.itemsize


@intrinsic
def _pointer(typing_context, address):
    """The pointer with this int64 address."""
    signature = types.voidptr(types.int64)

    def codegen(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))

    return signature, codegen


@kernel
def table(address, shape, dtype):
    """The array that lies at an address; its owner must outlive the call."""
    return carray(_pointer(address), shape, dtype)


@kernel
def header_at(address):
    return carray(_pointer(address), 1, HEADER)[0]


@kernel
def workspace_at(address):
    return carray(_pointer(address), 1, WORKSPACE)[0]


@kernel
def bodies_of(header, world):
    """(bodies,) rows of BODY of one world."""
    return carray(_pointer(header.bodies + world * header.num_bodies * _BODY_BYTES), header.num_bodies, BODY)


@kernel
def address_of_states(header, world):
    return header.states + world * header.num_bodies * _STATE_BYTES


@kernel
def states_of(header, world):
    """(bodies,) rows of BODY_STATE of one world."""
    return carray(_pointer(address_of_states(header, world)), header.num_bodies, BODY_STATE)


@kernel
def starts_of(header, workspace):
    """(bodies,) rows of BODY_STATE where the present part of the step begins."""
    return carray(_pointer(workspace.starts), header.num_bodies, BODY_STATE)


@kernel
def contacts_of(header, world):
    """(capacity,) rows of CONTACT of one world: those of its last step."""
    offset = world * header.contact_capacity * _CONTACT_BYTES
    return carray(_pointer(header.contacts + offset), header.contact_capacity, CONTACT)


@kernel
def grid_of(header, world):
    """The GRID record of one world."""
    return carray(_pointer(header.grids), header.num_worlds, GRID)[world]


@kernel
def grid_tables_of(header, world):
    """(bodies,) proxies, (slots,) cells and (pair capacity,) candidates of one world."""
    return (
        carray(_pointer(header.proxies + world * header.num_bodies * _PROXY_BYTES), header.num_bodies, PROXY),
        carray(_pointer(header.cells + world * header.num_slots * _CELL_BYTES), header.num_slots, CELL),
        carray(
            _pointer(header.candidates + 8 * world * header.candidate_capacity), header.candidate_capacity, np.int64
        ),
    )


@kernel
def asleep_contacts_of(header, world):
    """(capacity,) rows of CONTACT of one world: those of islands that sleep."""
    offset = world * header.asleep_capacity * _CONTACT_BYTES
    return carray(_pointer(header.asleep_contacts + offset), header.asleep_capacity, CONTACT)


@kernel
def rest_of(header, world):
    """(bodies,) rows of REST of one world."""
    return carray(_pointer(header.rest + world * header.num_bodies * _REST_BYTES), header.num_bodies, REST)


@kernel
def traits_of(header, world):
    """The TRAITS record of one world."""
    return carray(_pointer(header.traits), header.num_worlds, TRAITS)[world]


@kernel
def colliders_of(header):
    return carray(_pointer(header.colliders), header.colliders_size, COLLIDER)


@kernel
def wears(body, collider):
    """Whether a body has the collider of this number in its world: it is not one of its other alternatives."""
    return body.first_collider <= collider < body.first_collider + body.num_colliders


@kernel
def fields_of(header):
    return carray(_pointer(header.fields), header.fields_size, FIELD)


@kernel
def hulls_of(header):
    """Rows, points, faces and corners of all hulls."""
    return (
        table(header.hulls, header.hulls_size, HULL_ROW),
        table(header.hull_points, (header.hull_points_size // 3, 3), np.float64),
        table(header.hull_faces, header.hull_faces_size, HULL_FACE_ROW),
        table(header.hull_corners, header.hull_corners_size, np.int64),
    )


@kernel
def mesh_of(header, number):
    """Tables of one mesh by its number: MESH_ROW (1), VERTEX_ROW, FACE_ROW, NODE_ROW."""
    rows = table(header.meshes, header.meshes_size, MESH_ROW)[number : number + 1]
    row = rows[0]
    vertices = table(header.mesh_vertices, header.mesh_vertices_size, VERTEX_ROW)
    faces = table(header.mesh_faces, header.mesh_faces_size, FACE_ROW)
    nodes = table(header.mesh_nodes, header.mesh_nodes_size, NODE_ROW)
    return (
        rows,
        vertices[row.first_vertex : row.first_vertex + row.num_vertices],
        faces[row.first_face : row.first_face + row.num_faces],
        nodes[row.first_node : row.first_node + row.num_nodes],
    )


@kernel
def height_field_of(header, number):
    """The row of one height field."""
    return table(header.height_fields, header.height_fields_size, HEIGHT_FIELD_ROW)[number]


@kernel
def pool_address(address, header, world):
    """Address of one world's samples in a table of floats (1 or worlds, samples)."""
    return address + (8 * world * header.num_heights if header.height_worlds > 1 else 0)


@kernel
def height_pool(address, header, world):
    """(samples,) of one world in a table of floats (1 or worlds, samples)."""
    return table(pool_address(address, header, world), header.num_heights, np.float64)


@kernel
def heights_of(header, world):
    """(samples,) heights [m] of one world."""
    return height_pool(header.heights, header, world)


@kernel
def vectors_of(address, header, world, width):
    """(bodies, width) rows of one world in a table of floats (worlds, bodies, width)."""
    offset = 8 * world * header.num_bodies * width
    return carray(_pointer(address + offset), (header.num_bodies, width), np.float64)


@kernel
def world_entry(address, world):
    """(1,) the entry of one world in a table of integers (worlds,)."""
    return carray(_pointer(address + 8 * world), 1, np.int64)


@kernel
def report_of(header, world):
    return carray(_pointer(header.reports), header.num_worlds, REPORT)[world]
