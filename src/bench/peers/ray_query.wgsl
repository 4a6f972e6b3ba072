// One ray an invocation, answered by the driver's own structure.
enable wgpu_ray_query;

@group(0) @binding(0) var scene: acceleration_structure;
@group(0) @binding(1) var<storage, read> rays: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> answers: array<vec4<u32>>;

const MISS = vec4<u32>(1u, 0u, 0u, 0u);
const TERMINATE_ON_FIRST_HIT = 4u;

fn answer(flags: u32, item: u32) {
    if (item >= arrayLength(&answers)) {
        return;
    }
    let a = rays[2u * item];
    let b = rays[2u * item + 1u];
    if (a.w > b.w) {
        answers[item] = MISS;
        return;
    }
    var query: ray_query;
    rayQueryInitialize(&query, scene, RayDesc(flags, 0xffu, a.w, b.w, a.xyz, b.xyz));
    while (rayQueryProceed(&query)) {}
    let hit = rayQueryGetCommittedIntersection(&query);
    if (hit.kind == RAY_QUERY_INTERSECTION_NONE) {
        answers[item] = MISS;
    } else {
        answers[item] = vec4<u32>(2u, bitcast<u32>(hit.t), hit.primitive_index, 0u);
    }
}

@compute @workgroup_size(64)
fn nearest_hit(@builtin(global_invocation_id) id: vec3<u32>) {
    answer(0u, id.x);
}

@compute @workgroup_size(64)
fn any_hit(@builtin(global_invocation_id) id: vec3<u32>) {
    answer(TERMINATE_ON_FIRST_HIT, id.x);
}
