// sateen: a fabric's reflectance, in WGSL. Needs
//
//     fn sateen_parameter(index: i32) -> vec4f    parameters[index]
//     fn sateen_volume(uvw: vec3f) -> vec4f       the volume there: textureSampleLevel, linear filter, clamped, level 0
//
// Directions are unit vectors in the surface frame: x warp, y weft, z normal; wi to the light, wr to the viewer. All of
// it needs 32-bit floats. Functions are those of the Rust library (src/shader/lookup.rs, src/brdf, src/chart), where every step is
// derived; src/shader/mod.rs has the layout of the parameters.

const SATEEN_PI: f32 = 3.14159265358979;
// Keeps quotients of nothing finite.
const SATEEN_TINY: f32 = 1e-30;
// A direction that rises less than this above a cylinder's horizon sees nothing of it.
const SATEEN_UNSEEN: f32 = 1e-18;
// How far within its box a grid and placed nodes are blended.
const SATEEN_BAND: f32 = 0.05;
// Where in the parameters threads begin, and how many each takes.
const SATEEN_HEADER: i32 = 2;
const SATEEN_THREAD: i32 = 7;

fn sateen_norm2(x: f32, y: f32) -> f32 {
    return sqrt(x * x + y * y);
}

// The angle of the point (x, y), 0 at the origin. To 3e-7: APIs promise as little as 1e-3, and nothing on the axes.
fn sateen_atan2(y: f32, x: f32) -> f32 {
    let ax = abs(x);
    let ay = abs(y);
    let a = min(ax, ay) / max(max(ax, ay), SATEEN_TINY);
    let a2 = a * a;
    var sum = -0.00478045642;
    sum = sum * a2 + 0.0245571304;
    sum = sum * a2 - 0.0599047281;
    sum = sum * a2 + 0.0994276032;
    sum = sum * a2 - 0.140294209;
    sum = sum * a2 + 0.199713752;
    sum = sum * a2 - 0.333320946;
    sum = sum * a2 + 0.99999994;
    var angle = a * sum;
    angle = select(angle, 0.5 * SATEEN_PI - angle, ax < ay);
    angle = select(angle, SATEEN_PI - angle, x < 0.0);
    return select(angle, -angle, y < 0.0);
}

// ---- Psi: an angle in the plane of thread and normal, as (cos, sin).

// Of a direction in thread coordinates, and sqrt(x² + z²).
fn sateen_psi(w: vec3f) -> vec3f {
    let r = sateen_norm2(w.x, w.z);
    return select(vec3f(1.0, 0.0, 0.0), vec3f(w.z / r, w.x / r, r), r > 0.0);
}

// cos(psi + delta).
fn sateen_facing(psi: vec2f, delta: vec2f) -> f32 {
    return psi.x * delta.x - psi.y * delta.y;
}

// psi + delta.
fn sateen_turned(psi: vec2f, delta: vec2f) -> vec2f {
    return vec2f(sateen_facing(psi, delta), psi.y * delta.x + psi.x * delta.y);
}

// The same where it is within ±90°, else the nearer of the two.
fn sateen_visible(psi: vec2f) -> vec2f {
    let beyond = select(1.0, -1.0, psi.y < 0.0);
    return vec2f(max(psi.x, 0.0), select(beyond, psi.y, psi.x > 0.0));
}

// tan((b − a)/2).
fn sateen_half_tangent(a: vec2f, b: vec2f) -> f32 {
    return (b.y * a.x - b.x * a.y) / (1.0 + (b.x * a.x + b.y * a.y));
}

// ---- Cylinder

struct SateenPair {
    wi: vec3f,
    wr: vec3f,
    psi_i: vec2f,
    psi_r: vec2f,
    r_i: f32,
    r_r: f32,
    sigma_u: f32,
    u_psi: f32,
}

struct SateenScattered {
    surface: f32,
    lobe: f32,
    isotropic: f32,
    surface_lobe: f32,
    volume_lobe: f32,
    slope: f32,
}

// F_r and 1 − F_r.
fn sateen_fresnel(contrast: f32, cosine: f32) -> vec2f {
    let cos2 = cosine * cosine;
    let g = sqrt(contrast + cos2);
    let s = cosine + g;
    let p = s + contrast * cosine;
    let over_s = 1.0 / max(s, SATEEN_TINY);
    let over_p = 1.0 / max(p, SATEEN_TINY);
    let r_s = (contrast * over_s) * over_s;
    let r_p = (contrast * over_p) * (((contrast + 2.0) * cos2 - 1.0) * over_p);
    let t_s = (cosine * over_s) * (g * over_s);
    let t_p = (cosine * over_p) * (g * over_p);
    return vec2f(0.5 * (r_s * r_s + r_p * r_p), 2.0 * (t_s + (contrast + 1.0) * t_p));
}

// Gaussian of unit area.
fn sateen_gaussian(sigma: f32, x: f32) -> f32 {
    let t = x / sigma;
    return exp(-0.5 * t * t) * 0.398942280 / sigma;
}

// Gaussian of unit height, of the angle with these half-angle sine and cosine.
fn sateen_correlation(sigma: f32, sin_half: f32, cos_half: f32) -> f32 {
    let t = 2.0 * sateen_atan2(sin_half, cos_half) / sigma;
    return exp(-0.5 * t * t);
}

fn sateen_blend(u: f32, a: f32, b: f32) -> f32 {
    return (1.0 - u) * a * b + u * min(a, b);
}

fn sateen_thread_pair(wi: vec3f, wr: vec3f, sigma_u: f32) -> SateenPair {
    var pair: SateenPair;
    pair.wi = wi;
    pair.wr = wr;
    let a = sateen_psi(wi);
    let b = sateen_psi(wr);
    pair.psi_i = a.xy;
    pair.psi_r = b.xy;
    pair.r_i = a.z;
    pair.r_r = b.z;
    pair.sigma_u = sigma_u;
    pair.u_psi = sateen_correlation(sigma_u, length(a.xy - b.xy), length(a.xy + b.xy));
    return pair;
}

// P at a tilt.
fn sateen_visibility(pair: SateenPair, delta: vec2f) -> f32 {
    let p_i = max(sateen_facing(pair.psi_i, delta), 0.0);
    let p_r = max(sateen_facing(pair.psi_r, delta), 0.0);
    return sateen_blend(pair.u_psi, p_i, p_r);
}

// What S and V are made of, of the cylinder with cos ψ_i = p_i, cos ψ_r = p_r and x_i + x_r = x_sum in its own frame.
fn sateen_scatter(pair: SateenPair, optics: vec4f, p_i: f32, p_r: f32, x_sum: f32) -> SateenScattered {
    var parts: SateenScattered;
    let z_i = pair.r_i * p_i;
    let z_r = pair.r_r * p_r;
    let visible = z_i > SATEEN_UNSEEN && z_r > SATEEN_UNSEEN;
    let cos_i = max(sateen_norm2(pair.wi.y, z_i), SATEEN_TINY);
    let cos_r = max(sateen_norm2(pair.wr.y, z_r), SATEEN_TINY);
    let cos_sum = cos_i + cos_r;
    let theta_h = sateen_atan2(x_sum, cos_sum);
    let cos2_theta_d = 0.25 * (x_sum * x_sum + cos_sum * cos_sum);

    let phi_i = vec2f(z_i, pair.wi.y) / cos_i;
    let phi_r = vec2f(z_r, pair.wr.y) / cos_r;
    let cos_half_phi_d = 0.5 * length(phi_i + phi_r);
    let sin_half_phi_d = 0.5 * length(phi_i - phi_r);
    let u_phi = sateen_correlation(pair.sigma_u, sin_half_phi_d, cos_half_phi_d);
    let masking = sateen_blend(u_phi, phi_i.x, phi_r.x);
    let visibility = sateen_blend(pair.u_psi, p_i, p_r);
    let lit = masking * visibility * cos_i / max(cos2_theta_d, SATEEN_TINY);

    let fresnel = sateen_fresnel(optics.x, min(sqrt(cos2_theta_d) * cos_half_phi_d, 1.0));
    let entered = fresnel.y * fresnel.y;
    parts.surface_lobe = sateen_gaussian(optics.z, theta_h);
    parts.volume_lobe = sateen_gaussian(optics.w, theta_h);
    let scattered = select(0.0, lit * entered / cos_sum, visible);
    parts.surface = select(0.0, lit * fresnel.x * cos_half_phi_d * parts.surface_lobe, visible);
    parts.lobe = scattered * (1.0 - optics.y) * parts.volume_lobe;
    parts.isotropic = scattered * optics.y;
    parts.slope = 0.5 * (phi_i.x + phi_r.x);
    return parts;
}

// S and V of the cylinder at a tilt.
fn sateen_response(pair: SateenPair, optics: vec4f, delta: vec2f) -> vec2f {
    let x_sum = delta.x * (pair.wi.x + pair.wr.x) + delta.y * (pair.wi.z + pair.wr.z);
    let p_i = sateen_facing(pair.psi_i, delta);
    let p_r = sateen_facing(pair.psi_r, delta);
    let parts = sateen_scatter(pair, optics, p_i, p_r, x_sum);
    return vec2f(parts.surface, parts.lobe + parts.isotropic);
}

// ---- Tangents

// Two directions' angles in order.
struct SateenOrdered {
    first: vec2f,
    last: vec2f,
    sin_between: f32,
    cos_between: f32,
    is_swapped: bool,
}

// The tilts of an arc that both see: tan(half their width), and both angles at the lower and the upper end.
struct SateenSeen {
    half_tangent: f32,
    first_a: vec2f,
    first_b: vec2f,
    last_a: vec2f,
    last_b: vec2f,
}

fn sateen_order(pair: SateenPair) -> SateenOrdered {
    var order: SateenOrdered;
    let a = pair.psi_i;
    let b = pair.psi_r;
    order.is_swapped = b.y * a.x < a.y * b.x;
    order.first = select(a, b, order.is_swapped);
    order.last = select(b, a, order.is_swapped);
    order.sin_between = order.last.y * order.first.x - order.last.x * order.first.y;
    order.cos_between = order.last.x * order.first.x + order.last.y * order.first.y;
    return order;
}

// Minus half the angle between.
fn sateen_half_back(order: SateenOrdered) -> vec2f {
    let larger = sqrt(0.5 * (1.0 + abs(order.cos_between)));
    let smaller = 0.5 * max(order.sin_between, 0.0) / larger;
    return select(vec2f(larger, -smaller), vec2f(smaller, -larger), order.cos_between < 0.0);
}

fn sateen_seen(order: SateenOrdered, arc: i32) -> SateenSeen {
    var seen: SateenSeen;
    let ends = sateen_parameter(arc);
    let low = sateen_turned(order.first, ends.xy);
    let up = sateen_turned(order.last, ends.zw);
    let is_from = low.x > 0.0;
    let is_to = up.x > 0.0;
    let apart = vec2f(order.sin_between, order.cos_between);
    seen.first_a = sateen_visible(low);
    seen.last_b = sateen_visible(up);
    // Where one direction is at its horizon, the other is as far from there as they are apart.
    let last_a = sateen_turned(order.last, ends.xy);
    let first_b = sateen_turned(order.first, ends.zw);
    let last_apart = seen.first_a.y * vec2f(-apart.x, apart.y);
    let first_apart = seen.last_b.y * apart;
    seen.last_a = select(last_apart, last_a, is_from);
    seen.first_b = select(first_apart, first_b, is_to);
    let of_first = sateen_half_tangent(seen.first_a, seen.first_b);
    let of_last = sateen_half_tangent(seen.last_a, seen.last_b);
    let narrowed = select(of_last, of_first, is_to);
    seen.half_tangent = select(narrowed, sateen_parameter(arc + 1).x, is_from && is_to);
    return seen;
}

// Integral of max(cos(psi + delta), 0) over an arc.
fn sateen_arc_projection(arc: i32, psi: vec2f) -> f32 {
    let ends = sateen_parameter(arc);
    var a = sateen_turned(psi, ends.xy);
    var b = sateen_turned(psi, ends.zw);
    let is_whole = a.x > 0.0 && b.x > 0.0;
    a = sateen_visible(a);
    b = sateen_visible(b);
    let half_tangent = select(sateen_half_tangent(a, b), sateen_parameter(arc + 1).x, is_whole);
    return half_tangent * (a.x + b.x);
}

// atan T − T/(1 + T²).
fn sateen_angle_beyond_sine(t: f32) -> f32 {
    let t2 = t * t;
    let series = t * t2 * (2.0 / 3.0 - t2 * (4.0 / 5.0 - t2 * (6.0 / 7.0)));
    let closed = sateen_atan2(t, 1.0) - t / (1.0 + t2);
    return select(closed, series, t < 0.1);
}

// Integral of P over the tilts of an arc.
fn sateen_joint_integral(order: SateenOrdered, seen: SateenSeen, u: f32) -> f32 {
    let t = seen.half_tangent;
    let sums = (seen.first_a.x + seen.first_b.x) * (seen.last_a.x + seen.last_b.x);
    let product = 0.5 * t * sums + order.cos_between * sateen_angle_beyond_sine(t);
    let turn = sateen_half_back(order);
    let falling = min(max(sateen_half_tangent(seen.first_a, turn), 0.0), t);
    let rising = (t - falling) / (1.0 + t * falling);
    let first_turn = select(seen.first_b.x, turn.x, falling < t);
    let last_turn = select(seen.last_a.x, turn.x, falling > 0.0);
    let smaller = falling * (seen.first_a.x + first_turn) + rising * (last_turn + seen.last_b.x);
    return select(0.0, max((1.0 - u) * product + u * smaller, 0.0), t > 0.0);
}

// S and V of a thread's single tilts. `parts` are its first tilt, how many, its first arc, how many.
fn sateen_response_of_tilts(pair: SateenPair, optics: vec4f, parts: vec4f) -> vec2f {
    var response = vec2f(0.0, 0.0);
    let count = i32(parts.y);
    for (var k = 0; k < count; k++) {
        let tilt = sateen_parameter(i32(parts.x) + k);
        response += tilt.z * sateen_response(pair, optics, tilt.xy);
    }
    return response;
}

// What Q sums of a thread: the mean projection towards the viewer.
fn sateen_projection(psi: vec2f, parts: vec4f) -> f32 {
    var sum = 0.0;
    let arcs = i32(parts.w);
    for (var k = 0; k < arcs; k++) {
        let arc = i32(parts.z) + 2 * k;
        sum += sateen_parameter(arc + 1).y * sateen_arc_projection(arc, psi);
    }
    let tilts = i32(parts.y);
    for (var k = 0; k < tilts; k++) {
        let tilt = sateen_parameter(i32(parts.x) + k);
        sum += tilt.z * max(sateen_facing(psi, tilt.xy), 0.0);
    }
    return sum;
}

// The same by both directions.
fn sateen_joint_projection(pair: SateenPair, parts: vec4f) -> f32 {
    let order = sateen_order(pair);
    var sum = 0.0;
    let arcs = i32(parts.w);
    for (var k = 0; k < arcs; k++) {
        let arc = i32(parts.z) + 2 * k;
        let mean = sateen_joint_integral(order, sateen_seen(order, arc), pair.u_psi);
        sum += sateen_parameter(arc + 1).y * mean;
    }
    let tilts = i32(parts.y);
    for (var k = 0; k < tilts; k++) {
        let tilt = sateen_parameter(i32(parts.x) + k);
        sum += tilt.z * sateen_visibility(pair, tilt.xy);
    }
    return sum;
}

// ---- Placed nodes: src/brdf/placed.rs

struct SateenHighlight {
    order: SateenOrdered,
    // Of the first and the last direction.
    radii: vec2f,
    sides: vec2f,
    h: f32,
    // (cos, sin) of psi_H.
    turn: vec2f,
    low: f32,
    up: f32,
    width: f32,
}

struct SateenEnd {
    q: f32,
    over: f32,
    t: f32,
    stretch: f32,
}

struct SateenSums {
    surface: f32,
    lobe: f32,
    isotropic: f32,
    surface_area: f32,
    volume_area: f32,
}

// 1 − erf|x| to 3e-7: M. Abramowitz, I. Stegun, Handbook of Mathematical Functions, 1964, 7.1.28.
fn sateen_erfc_abs(x: f32) -> f32 {
    let a = min(abs(x), 10.0);
    var sum = 0.0000430638 * a;
    sum = (sum + 0.0002765672) * a;
    sum = (sum + 0.0001520143) * a;
    sum = (sum + 0.0092705272) * a;
    sum = (sum + 0.0422820123) * a;
    sum = (sum + 0.0705230784) * a;
    let r = 1.0 / (1.0 + sum);
    let r2 = r * r;
    let r4 = r2 * r2;
    let r8 = r4 * r4;
    return r8 * r8;
}

// The lobe's area over what the nodes make of it; 1 where the segment is narrow against the lobe.
fn sateen_exactness(gamma: f32, theta_a: f32, theta_b: f32, summed: f32) -> f32 {
    let k = 0.707106781 / gamma;
    let rest_a = sateen_erfc_abs(k * theta_a);
    let rest_b = sateen_erfc_abs(k * theta_b);
    let is_across = theta_a < 0.0 && theta_b > 0.0;
    let area = 0.5 * (select(abs(rest_a - rest_b), 2.0 - rest_a - rest_b, is_across));
    let is_narrow = theta_b - theta_a < 0.25 * gamma;
    return select(area / (max(summed, 0.0) + SATEEN_TINY), 1.0, is_narrow);
}

// q at which a direction with |x'| = x and z' = z passes behind the thread.
fn sateen_horizon(x: f32, z: f32) -> f32 {
    return min(z / (sateen_norm2(x, z) + x + SATEEN_TINY), 1.0);
}

fn sateen_highlight(pair: SateenPair, optics: vec4f, half_reach: f32) -> SateenHighlight {
    var highlight: SateenHighlight;
    highlight.order = sateen_order(pair);
    let is_swapped = highlight.order.is_swapped;
    highlight.radii = select(vec2f(pair.r_i, pair.r_r), vec2f(pair.r_r, pair.r_i), is_swapped);
    highlight.sides = select(vec2f(pair.wi.y, pair.wr.y), vec2f(pair.wr.y, pair.wi.y), is_swapped);
    let h = vec2f(pair.wi.z + pair.wr.z, pair.wi.x + pair.wr.x);
    highlight.h = max(length(h), SATEEN_TINY);
    highlight.turn = h / highlight.h;
    let x = abs(highlight.turn.x * pair.wi.x - highlight.turn.y * pair.wi.z);
    let z_i = highlight.turn.x * pair.wi.z + highlight.turn.y * pair.wi.x;
    let z_r = highlight.turn.x * pair.wr.z + highlight.turn.y * pair.wr.x;
    highlight.low = -sateen_horizon(x, select(z_i, z_r, is_swapped));
    highlight.up = sateen_horizon(x, select(z_r, z_i, is_swapped));
    let slope = highlight.h / (2.0 * max(sateen_norm2(pair.wi.y, z_i), 1e-6));
    highlight.width = half_reach * min(optics.z, optics.w) / max(slope, 1e-3);
    return highlight;
}

// q of a tilt, within what is visible.
fn sateen_q(highlight: SateenHighlight, delta: vec2f) -> f32 {
    let beta = sateen_turned(highlight.turn, delta);
    let under = 1.0 + beta.x;
    // Near ±180°, where nothing is visible, it is enough that q is beyond ±1.
    let q = beta.y / select(under, max(0.5 * abs(beta.y), SATEEN_TINY), under < 1e-6);
    return max(min(q, highlight.up), highlight.low);
}

fn sateen_theta_h(highlight: SateenHighlight, q: f32, first: f32, last: f32) -> f32 {
    let cos_sum = sateen_norm2(highlight.sides.x, highlight.radii.x * first)
        + sateen_norm2(highlight.sides.y, highlight.radii.y * last);
    let x_sum = highlight.h * 2.0 * q * (1.0 / (1.0 + q * q));
    return sateen_atan2(x_sum, max(cos_sum, SATEEN_TINY));
}

fn sateen_end(q: f32, width: f32) -> SateenEnd {
    var end: SateenEnd;
    let x = q / width;
    end.q = q;
    end.over = 1.0 / (1.0 + q * q);
    end.stretch = 0.5 * (1.0 + sqrt(1.0 + 4.0 * x * x));
    end.t = x / end.stretch;
    return end;
}

// cos and sin of what the tilt differs from that at the end a `distance` in q away, at q; `over` is 1/(1 + q²).
fn sateen_end_turn(end: SateenEnd, q: f32, over: f32, distance: f32) -> vec2f {
    let c = 1.0 + q * end.q;
    let s = distance;
    return vec2f(c * c - s * s, 2.0 * c * s) * (over * end.over);
}

// What the nodes make of a segment between two ends in q.
fn sateen_sum(pair: SateenPair, optics: vec4f, highlight: SateenHighlight, seen: SateenSeen, q_ends: vec2f, width: f32, nodes: vec2f) -> SateenSums {
    var sums: SateenSums;
    sums.surface = 0.0;
    sums.lobe = 0.0;
    sums.isotropic = 0.0;
    sums.surface_area = 0.0;
    sums.volume_area = 0.0;
    let a = sateen_end(q_ends.x, width);
    let b = sateen_end(q_ends.y, width);
    // t_b − t_a: where the ends are close together, from the width that is seen.
    let product = 1.0 + a.q * b.q;
    let apart = select(b.q - a.q, seen.half_tangent * product, b.q - a.q < 0.5 * product);
    let close = apart / (width * a.stretch * b.stretch * (1.0 + a.t * b.t));
    let half_length = 0.5 * max(select(b.t - a.t, close, b.t - a.t < 0.5), 0.0);
    // 1 + t and 1 − t, which are small beside a narrow highlight.
    let above = select(1.0 + a.t, 1.0 / (a.stretch * (1.0 - a.t)), a.t < 0.0);
    let below = select(1.0 - b.t, 1.0 / (b.stretch * (1.0 + b.t)), b.t > 0.0);
    let count = i32(nodes.y);
    for (var k = 0; k < count; k++) {
        let node = sateen_parameter(i32(nodes.x) + k);
        let from_a = half_length * (1.0 + node.x);
        let to_b = half_length * (1.0 - node.x);
        let up = above + from_a;
        let down = below + to_b;
        let t = 0.5 * (up - down);
        let stretch = 1.0 / (up * down);
        let q = width * t * stretch;
        let over = 1.0 / (1.0 + q * q);
        let jacobian = (1.0 + t * t) * stretch * stretch * over;
        let weight = 2.0 * half_length * width * node.y * jacobian;

        // Each direction is turned from the end where it may be at its horizon: its cosine is small there.
        let distance = width * stretch;
        let turn_a = sateen_end_turn(a, q, over, distance * a.stretch * from_a * (1.0 + t * a.t));
        let first = sateen_facing(seen.first_a, turn_a);
        let turn_b = sateen_end_turn(b, q, over, distance * b.stretch * to_b * (1.0 + t * b.t));
        let last = seen.last_b.x * turn_b.x + seen.last_b.y * turn_b.y;
        let p_i = select(first, last, highlight.order.is_swapped);
        let p_r = select(last, first, highlight.order.is_swapped);

        let x_sum = highlight.h * 2.0 * q * over;
        let parts = sateen_scatter(pair, optics, p_i, p_r, x_sum);
        sums.surface += weight * parts.surface;
        sums.lobe += weight * parts.lobe;
        sums.isotropic += weight * parts.isotropic;
        sums.surface_area += weight * parts.slope * parts.surface_lobe;
        sums.volume_area += weight * parts.slope * parts.volume_lobe;
    }
    return sums;
}

// Integral of S and V over a segment. `placed` has c/2, is stiff, surface lobe is wide, volume lobe is wide.
fn sateen_segment(pair: SateenPair, optics: vec4f, highlight: SateenHighlight, segment: i32, nodes: vec2f, placed: vec4f) -> vec2f {
    let seen = sateen_seen(highlight.order, segment);
    let ends = sateen_parameter(segment);
    let q_ends = vec2f(sateen_q(highlight, ends.xy), sateen_q(highlight, ends.zw));
    let theta_a = sateen_theta_h(highlight, q_ends.x, seen.first_a.x, seen.last_a.x);
    let theta_b = sateen_theta_h(highlight, q_ends.y, seen.first_b.x, seen.last_b.x);
    let near_sums = sateen_sum(pair, optics, highlight, seen, q_ends, highlight.width, nodes);
    var of_surface = near_sums;
    var of_volume = near_sums;
    var isotropic = near_sums.isotropic;
    if (placed.y > 0.5) {
        let narrower = min(optics.z, optics.w);
        let wider = max(optics.z, optics.w);
        let width = select(4.0, highlight.width * wider / narrower, placed.z + placed.w > 0.5);
        let wide = sateen_sum(pair, optics, highlight, seen, q_ends, width, nodes);
        if (placed.z > 0.5) {
            of_surface = wide;
        }
        if (placed.w > 0.5) {
            of_volume = wide;
        }
        isotropic = wide.isotropic;
    }
    let surface = of_surface.surface
        * sateen_exactness(optics.z, theta_a, theta_b, of_surface.surface_area);
    let lobe = of_volume.lobe
        * sateen_exactness(optics.w, theta_a, theta_b, of_volume.volume_area);
    return vec2f(surface, lobe + isotropic);
}

// S and V of a thread's segments. `parts` are its first segment, how many, its first node, how many.
fn sateen_mean_response(pair: SateenPair, optics: vec4f, parts: vec4f, placed: vec4f) -> vec2f {
    var response = vec2f(0.0, 0.0);
    let highlight = sateen_highlight(pair, optics, placed.x);
    let count = i32(parts.y);
    for (var k = 0; k < count; k++) {
        let segment = i32(parts.x) + 2 * k;
        let density = sateen_parameter(segment + 1).y;
        response += density * sateen_segment(pair, optics, highlight, segment, parts.zw, placed);
    }
    return response;
}

// ---- Charts: src/chart

// value/range in ±1 as a coordinate in 0 … 1; a half where the range is empty.
fn sateen_normalized(value: f32, range: f32) -> f32 {
    let normalized = clamp(0.5 + 0.5 * value / max(range, SATEEN_TINY), 0.0, 1.0);
    return select(0.5, normalized, range > 0.0);
}

// How high above a thread's horizon a direction is.
fn sateen_height(w: vec3f) -> f32 {
    return min(w.z / max(sateen_norm2(w.y, w.z), SATEEN_TINY), 1.5 * w.z);
}

// The share of a box that ends a `rim` before the horizon in the value of a pair.
fn sateen_share_of_box(rim: f32, wi: vec3f, wr: vec3f) -> f32 {
    let height = min(sateen_height(wi), sateen_height(wr));
    return select(1.0, clamp((height - rim) / SATEEN_BAND, 0.0, 1.0), rim > 0.0);
}

// `chart` is the first of a grid's parameters.
fn sateen_thread_coordinates(chart: vec4f, rim: f32, wi: vec3f, wr: vec3f) -> vec4f {
    let is_away = chart.y > 0.5 && wi.x + wr.x < 0.0;
    let x_i = select(wi.x, -wi.x, is_away);
    let x_r = select(wr.x, -wr.x, is_away);
    let theta_i = sateen_atan2(x_i, sateen_norm2(wi.y, wi.z));
    let theta_r = sateen_atan2(x_r, sateen_norm2(wr.y, wr.z));
    let phi_i = sateen_atan2(wi.y, wi.z);
    let phi_r = sateen_atan2(wr.y, wr.z);
    let theta_h = 0.5 * (theta_i + theta_r);
    let theta_d = 0.5 * (theta_i - theta_r);
    var phi_h = 0.5 * (phi_i + phi_r);
    var phi_d = phi_i - phi_r;
    let side = select(1.0, -1.0, phi_h < 0.0);
    phi_d = side * phi_d;
    phi_h = abs(phi_h);

    let psi = sateen_atan2(x_i + x_r, wi.z + wr.z);
    let half_pi = 0.5 * SATEEN_PI;
    let u0 = sateen_normalized(select(psi, theta_h, chart.x < 0.5), half_pi);
    let u1 = sateen_normalized(theta_d, half_pi - abs(theta_h));
    var u2 = sateen_normalized(phi_d, 2.0 * (half_pi - rim) - 2.0 * phi_h);
    var u3 = min(phi_h / (half_pi - rim), 1.0);
    if (chart.z < 0.5) {
        u2 = select(u2, 1.0 - u2, side < 0.0);
        u3 = 0.5 + 0.5 * side * u3;
    }
    return vec4f(u0, u1, u2, u3);
}

fn sateen_isotropic_coordinates(wi: vec3f, wr: vec3f) -> vec4f {
    let theta_i = sateen_atan2(sateen_norm2(wi.x, wi.y), wi.z);
    let theta_r = sateen_atan2(sateen_norm2(wr.x, wr.y), wr.z);
    let sum = theta_i + theta_r;
    let range = min(sum, SATEEN_PI - sum);
    let cross_z = wi.x * wr.y - wi.y * wr.x;
    let azimuth = sateen_atan2(abs(cross_z), wi.x * wr.x + wi.y * wr.y);
    let u0 = clamp(sum / SATEEN_PI, 0.0, 1.0);
    let u1 = sateen_normalized(theta_i - theta_r, range);
    return vec4f(u0, u1, min(azimuth / SATEEN_PI, 1.0), 0.0);
}

fn sateen_view_coordinates(chart: vec4f, wr: vec3f) -> vec4f {
    let theta = sateen_atan2(sateen_norm2(wr.x, wr.y), wr.z);
    let phi = sateen_atan2(wr.y, wr.x);
    let u0 = clamp(theta / (0.5 * SATEEN_PI), 0.0, 1.0);
    return vec4f(u0, select(sateen_normalized(phi, SATEEN_PI), 0.0, chart.z > 0.5), 0.0, 0.0);
}

// ---- Grids: src/volume

// u in nodes. `axis` has the first warp, how many pieces, nodes − 1.
fn sateen_warp(axis: vec4f, u: f32) -> f32 {
    let piece = i32(clamp(u * axis.y, 0.0, axis.y - 1.0));
    let two = sateen_parameter(i32(axis.x) + piece / 2);
    let straight = select(two.zw, two.xy, piece % 2 == 0);
    return clamp(straight.x + straight.y * u, 0.0, axis.z);
}

// S and V of the grid whose parameters begin there: one fetch.
fn sateen_grid(grid: i32, wi: vec3f, wr: vec3f) -> vec2f {
    let chart = sateen_parameter(grid);
    let last_axis = sateen_parameter(grid + 5);
    var u: vec4f;
    if (chart.x < 1.5) {
        u = sateen_thread_coordinates(chart, last_axis.w, wi, wr);
    } else if (chart.x < 2.5) {
        u = sateen_isotropic_coordinates(wi, wr);
    } else {
        u = sateen_view_coordinates(chart, wr);
    }
    let t0 = sateen_warp(sateen_parameter(grid + 2), u.x);
    let t1 = sateen_warp(sateen_parameter(grid + 3), u.y);
    let t2 = sateen_warp(sateen_parameter(grid + 4), u.z);
    let t3 = sateen_warp(last_axis, u.w);
    // What 1 stands for in S and V, nodes of u₂ and u₃.
    let scale = sateen_parameter(grid + 1);
    let slab = max(min(floor(t3), scale.w - 2.0), 0.0);
    let size = sateen_parameter(1).xyz;
    let texel = vec3f(t0, t1, chart.w + scale.z * slab + t2) + 0.5;
    let two = sateen_volume(texel / size);
    let roots = mix(two.xy, two.zw, t3 - slab);
    return scale.xy * roots * roots;
}

// ---- Cloth

// Surface to thread coordinates. `frame` has cos α, sin α.
fn sateen_to_thread(frame: vec4f, w: vec3f) -> vec3f {
    return vec3f(w.x * frame.x + w.y * frame.y, w.y * frame.x - w.x * frame.y, w.z);
}

// S, V and the projection of a thread.
fn sateen_thread_response(thread: i32, wi: vec3f, wr: vec3f) -> vec3f {
    // cos α, sin α, coverage, kind.
    let frame = sateen_parameter(thread);
    let thread_wi = sateen_to_thread(frame, wi);
    let thread_wr = sateen_to_thread(frame, wr);
    let grids = sateen_parameter(thread + 6);
    if (frame.w > 2.5) {
        var response = sateen_grid(i32(grids.x), thread_wi, thread_wr);
        var projection = sateen_grid(i32(grids.y), thread_wi, thread_wr);
        return vec3f(response, projection.x);
    }
    let head = sateen_parameter(0);
    let optics = sateen_parameter(thread + 2);
    let parts = sateen_parameter(thread + 3);
    let pair = sateen_thread_pair(thread_wi, thread_wr, head.y);
    var response = sateen_response_of_tilts(pair, optics, parts);
    // That of a grid in the segments.
    var share = 0.0;
    if (frame.w > 0.5 && frame.w < 1.5) {
        share = sateen_share_of_box(sateen_parameter(i32(grids.x) + 5).w, thread_wi, thread_wr);
    }
    if (frame.w > 0.5 && share < 1.0) {
        let segments = sateen_parameter(thread + 4);
        let placed = sateen_parameter(thread + 5);
        response += (1.0 - share) * sateen_mean_response(pair, optics, segments, placed);
    }
    if (share > 0.0) {
        response += share * sateen_grid(i32(grids.x), thread_wi, thread_wr);
    }
    var projection: f32;
    if (head.w > 0.5) {
        projection = sateen_joint_projection(pair, parts);
    } else {
        projection = sateen_projection(pair.psi_r, parts);
    }
    return vec3f(response, projection);
}

// The same by the thesis' rule: the mean over n midpoints of equal length. What changes its direction is in grids alone and
// evaluated by them.
fn sateen_direct_response(thread: i32, wi: vec3f, wr: vec3f, n: i32) -> vec3f {
    let frame = sateen_parameter(thread);
    if (frame.w > 2.5) {
        return sateen_thread_response(thread, wi, wr);
    }
    let thread_wi = sateen_to_thread(frame, wi);
    let thread_wr = sateen_to_thread(frame, wr);
    let head = sateen_parameter(0);
    let optics = sateen_parameter(thread + 2);
    let parts = sateen_parameter(thread + 3);
    let pair = sateen_thread_pair(thread_wi, thread_wr, head.y);
    let tilts = i32(parts.y);
    let count = tilts + i32(parts.w);
    var next = 0;
    var start = 0.0;
    var end = 0.0;
    var low = 0.0;
    var up = 0.0;
    var sum = vec3f(0.0, 0.0, 0.0);
    for (var k = 0; k < n; k++) {
        let place = (f32(k) + 0.5) / f32(n);
        // The tilt or arc that the place is in.
        while (next < count && place >= end) {
            start = end;
            if (next < tilts) {
                let tilt = sateen_parameter(i32(parts.x) + next);
                low = tilt.w;
                up = tilt.w;
                end += tilt.z;
            } else {
                let arc = sateen_parameter(i32(parts.z) + 2 * (next - tilts) + 1);
                low = arc.z;
                up = arc.w;
                end += arc.y * (arc.w - arc.z);
            }
            next++;
        }
        let angle = low + (up - low) * clamp((place - start) / max(end - start, SATEEN_TINY), 0.0, 1.0);
        let delta = vec2f(cos(angle), sin(angle));
        var seen = max(sateen_facing(pair.psi_r, delta), 0.0);
        if (head.w > 0.5) {
            seen = sateen_visibility(pair, delta);
        }
        sum += vec3f(sateen_response(pair, optics, delta), seen);
    }
    return sum / f32(n);
}

// Linear RGB of the first four threads.
struct SateenAlbedos {
    of_thread: array<vec3f, 4>,
}

// The fabric's own.
fn sateen_albedos() -> SateenAlbedos {
    var albedos: SateenAlbedos;
    let count = i32(sateen_parameter(1).w);
    for (var k = 0; k < 4; k++) {
        let thread = SATEEN_HEADER + SATEEN_THREAD * min(k, max(count - 1, 0));
        albedos.of_thread[k] = sateen_parameter(thread + 1).xyz;
    }
    return albedos;
}

// ρ with n midpoints, or by the lookup if n is 0.
fn sateen_weave(wi: vec3f, wr: vec3f, albedos: SateenAlbedos, n: i32) -> vec3f {
    if (!(wi.z > 0.0 && wr.z > 0.0)) {
        return vec3f(0.0, 0.0, 0.0);
    }
    let head = sateen_parameter(0);
    var q = head.x * wr.z;
    var sum = vec3f(0.0, 0.0, 0.0);
    let count = i32(sateen_parameter(1).w);
    for (var k = 0; k < count; k++) {
        let thread = SATEEN_HEADER + SATEEN_THREAD * k;
        var response: vec3f;
        if (n > 0) {
            response = sateen_direct_response(thread, wi, wr, n);
        } else {
            response = sateen_thread_response(thread, wi, wr);
        }
        var albedo = sateen_parameter(thread + 1).xyz;
        if (k < 4) {
            albedo = albedos.of_thread[k];
        }
        let coverage = sateen_parameter(thread).z;
        q += coverage * response.z;
        sum += coverage * (response.x + response.y * albedo);
    }
    // Where nothing of the cloth faces the viewer, nothing is seen.
    return select(vec3f(0.0, 0.0, 0.0), clamp(head.z * sum / max(q, SATEEN_TINY), vec3f(0.0), vec3f(3.0e38)), q > 0.0);
}

// ρ = BRDF × cosine [1/sr], with other albedos.
fn sateen_eval_cos_with(wi: vec3f, wr: vec3f, albedos: SateenAlbedos) -> vec3f {
    return sateen_weave(wi, wr, albedos, 0);
}

// The BRDF [1/sr], with other albedos.
fn sateen_eval_with(wi: vec3f, wr: vec3f, albedos: SateenAlbedos) -> vec3f {
    return min(sateen_eval_cos_with(wi, wr, albedos) / max(wi.z, SATEEN_TINY), vec3f(3.0e38));
}

// ρ = BRDF × cosine [1/sr], with the fabric's own albedo.
fn sateen_eval_cos(wi: vec3f, wr: vec3f) -> vec3f {
    return sateen_eval_cos_with(wi, wr, sateen_albedos());
}

// The BRDF [1/sr], with the fabric's own albedo.
fn sateen_eval(wi: vec3f, wr: vec3f) -> vec3f {
    return sateen_eval_with(wi, wr, sateen_albedos());
}

// ρ by direct integration with n midpoints per thread, for n closed forms; the thesis takes 50.
fn sateen_direct_cos(wi: vec3f, wr: vec3f, n: i32) -> vec3f {
    return sateen_weave(wi, wr, sateen_albedos(), max(n, 1));
}
