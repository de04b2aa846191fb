// sateen: a fabric's reflectance, in HLSL (shader model 4 and later). Made of lookup.glsl by scripts/hlsl.sh. Needs, before it:
//
//     float4 sateen_parameter(int index)      parameters[index]: 32-bit floats
//     float4 sateen_volume(float3 uvw)        the volume there: Texture3D.SampleLevel, linear filter, clamped, mip 0
//
// Directions are unit vectors in the surface frame: x warp, y weft, z normal; wi to the light, wr to the viewer. All of
// it needs 32-bit floats. Functions are those of the Rust library (src/shader/lookup.rs, src/brdf, src/chart), where every step is
// derived; src/shader/mod.rs has the layout of the parameters.

static const float SATEEN_PI = 3.14159265358979;
// Keeps quotients of nothing finite. Products, since Godot writes literals anew, with 14 decimals.
static const float SATEEN_TINY = 1e-10 * 1e-10 * 1e-10;
// A direction that rises less than this above a cylinder's horizon sees nothing of it.
static const float SATEEN_UNSEEN = 1e-9 * 1e-9;
// How far within its box a grid and placed nodes are blended.
static const float SATEEN_BAND = 0.05;
// Where in the parameters threads begin, and how many each takes.
static const int SATEEN_HEADER = 2;
static const int SATEEN_THREAD = 7;

float sateen_norm2(float x, float y) {
    return sqrt(x * x + y * y);
}

// The angle of the point (x, y), 0 at the origin. To 3e-7: APIs promise as little as 1e-3, and nothing on the axes.
float sateen_atan2(float y, float x) {
    float ax = abs(x);
    float ay = abs(y);
    float a = min(ax, ay) / max(max(ax, ay), SATEEN_TINY);
    float a2 = a * a;
    float sum = -0.00478045642;
    sum = sum * a2 + 0.0245571304;
    sum = sum * a2 - 0.0599047281;
    sum = sum * a2 + 0.0994276032;
    sum = sum * a2 - 0.140294209;
    sum = sum * a2 + 0.199713752;
    sum = sum * a2 - 0.333320946;
    sum = sum * a2 + 0.99999994;
    float angle = a * sum;
    angle = ax < ay ? 0.5 * SATEEN_PI - angle : angle;
    angle = x < 0.0 ? SATEEN_PI - angle : angle;
    return y < 0.0 ? -angle : angle;
}

// ---- Psi: an angle in the plane of thread and normal, as (cos, sin).

// Of a direction in thread coordinates, and sqrt(x² + z²).
float3 sateen_psi(float3 w) {
    float r = sateen_norm2(w.x, w.z);
    return r > 0.0 ? float3(w.z / r, w.x / r, r) : float3(1.0, 0.0, 0.0);
}

// cos(psi + delta).
float sateen_facing(float2 psi, float2 delta) {
    return psi.x * delta.x - psi.y * delta.y;
}

// psi + delta.
float2 sateen_turned(float2 psi, float2 delta) {
    return float2(sateen_facing(psi, delta), psi.y * delta.x + psi.x * delta.y);
}

// The same where it is within ±90°, else the nearer of the two.
float2 sateen_visible(float2 psi) {
    float beyond = psi.y < 0.0 ? -1.0 : 1.0;
    return float2(max(psi.x, 0.0), psi.x > 0.0 ? psi.y : beyond);
}

// tan((b − a)/2).
float sateen_half_tangent(float2 a, float2 b) {
    return (b.y * a.x - b.x * a.y) / (1.0 + (b.x * a.x + b.y * a.y));
}

// ---- Cylinder

struct SateenPair {
    float3 wi;
    float3 wr;
    float2 psi_i;
    float2 psi_r;
    float r_i;
    float r_r;
    float sigma_u;
    float u_psi;
};

struct SateenScattered {
    float surface;
    float lobe;
    float isotropic;
    float surface_lobe;
    float volume_lobe;
    float slope;
};

// F_r and 1 − F_r.
float2 sateen_fresnel(float contrast, float cosine) {
    float cos2 = cosine * cosine;
    float g = sqrt(contrast + cos2);
    float s = cosine + g;
    float p = s + contrast * cosine;
    float over_s = 1.0 / max(s, SATEEN_TINY);
    float over_p = 1.0 / max(p, SATEEN_TINY);
    float r_s = (contrast * over_s) * over_s;
    float r_p = (contrast * over_p) * (((contrast + 2.0) * cos2 - 1.0) * over_p);
    float t_s = (cosine * over_s) * (g * over_s);
    float t_p = (cosine * over_p) * (g * over_p);
    return float2(0.5 * (r_s * r_s + r_p * r_p), 2.0 * (t_s + (contrast + 1.0) * t_p));
}

// Gaussian of unit area.
float sateen_gaussian(float sigma, float x) {
    float t = x / sigma;
    return exp(-0.5 * t * t) * 0.398942280 / sigma;
}

// Gaussian of unit height, of the angle with these half-angle sine and cosine.
float sateen_correlation(float sigma, float sin_half, float cos_half) {
    float t = 2.0 * sateen_atan2(sin_half, cos_half) / sigma;
    return exp(-0.5 * t * t);
}

float sateen_blend(float u, float a, float b) {
    return (1.0 - u) * a * b + u * min(a, b);
}

SateenPair sateen_thread_pair(float3 wi, float3 wr, float sigma_u) {
    SateenPair pair;
    pair.wi = wi;
    pair.wr = wr;
    float3 a = sateen_psi(wi);
    float3 b = sateen_psi(wr);
    pair.psi_i = a.xy;
    pair.psi_r = b.xy;
    pair.r_i = a.z;
    pair.r_r = b.z;
    pair.sigma_u = sigma_u;
    pair.u_psi = sateen_correlation(sigma_u, length(a.xy - b.xy), length(a.xy + b.xy));
    return pair;
}

// P at a tilt.
float sateen_visibility(SateenPair pair, float2 delta) {
    float p_i = max(sateen_facing(pair.psi_i, delta), 0.0);
    float p_r = max(sateen_facing(pair.psi_r, delta), 0.0);
    return sateen_blend(pair.u_psi, p_i, p_r);
}

// What S and V are made of, of the cylinder with cos ψ_i = p_i, cos ψ_r = p_r and x_i + x_r = x_sum in its own frame.
SateenScattered sateen_scatter(SateenPair pair, float4 optics, float p_i, float p_r, float x_sum) {
    SateenScattered parts;
    float z_i = pair.r_i * p_i;
    float z_r = pair.r_r * p_r;
    bool visible = z_i > SATEEN_UNSEEN && z_r > SATEEN_UNSEEN;
    float cos_i = max(sateen_norm2(pair.wi.y, z_i), SATEEN_TINY);
    float cos_r = max(sateen_norm2(pair.wr.y, z_r), SATEEN_TINY);
    float cos_sum = cos_i + cos_r;
    float theta_h = sateen_atan2(x_sum, cos_sum);
    float cos2_theta_d = 0.25 * (x_sum * x_sum + cos_sum * cos_sum);

    float2 phi_i = float2(z_i, pair.wi.y) / cos_i;
    float2 phi_r = float2(z_r, pair.wr.y) / cos_r;
    float cos_half_phi_d = 0.5 * length(phi_i + phi_r);
    float sin_half_phi_d = 0.5 * length(phi_i - phi_r);
    float u_phi = sateen_correlation(pair.sigma_u, sin_half_phi_d, cos_half_phi_d);
    float masking = sateen_blend(u_phi, phi_i.x, phi_r.x);
    float visibility = sateen_blend(pair.u_psi, p_i, p_r);
    float lit = masking * visibility * cos_i / max(cos2_theta_d, SATEEN_TINY);

    float2 fresnel = sateen_fresnel(optics.x, min(sqrt(cos2_theta_d) * cos_half_phi_d, 1.0));
    float entered = fresnel.y * fresnel.y;
    parts.surface_lobe = sateen_gaussian(optics.z, theta_h);
    parts.volume_lobe = sateen_gaussian(optics.w, theta_h);
    float scattered = visible ? lit * entered / cos_sum : 0.0;
    parts.surface = visible ? lit * fresnel.x * cos_half_phi_d * parts.surface_lobe : 0.0;
    parts.lobe = scattered * (1.0 - optics.y) * parts.volume_lobe;
    parts.isotropic = scattered * optics.y;
    parts.slope = 0.5 * (phi_i.x + phi_r.x);
    return parts;
}

// S and V of the cylinder at a tilt.
float2 sateen_response(SateenPair pair, float4 optics, float2 delta) {
    float x_sum = delta.x * (pair.wi.x + pair.wr.x) + delta.y * (pair.wi.z + pair.wr.z);
    float p_i = sateen_facing(pair.psi_i, delta);
    float p_r = sateen_facing(pair.psi_r, delta);
    SateenScattered parts = sateen_scatter(pair, optics, p_i, p_r, x_sum);
    return float2(parts.surface, parts.lobe + parts.isotropic);
}

// ---- Tangents

// Two directions' angles in order.
struct SateenOrdered {
    float2 first;
    float2 last;
    float sin_between;
    float cos_between;
    bool is_swapped;
};

// The tilts of an arc that both see: tan(half their width), and both angles at the lower and the upper end.
struct SateenSeen {
    float half_tangent;
    float2 first_a;
    float2 first_b;
    float2 last_a;
    float2 last_b;
};

SateenOrdered sateen_order(SateenPair pair) {
    SateenOrdered order;
    float2 a = pair.psi_i;
    float2 b = pair.psi_r;
    order.is_swapped = b.y * a.x < a.y * b.x;
    order.first = order.is_swapped ? b : a;
    order.last = order.is_swapped ? a : b;
    order.sin_between = order.last.y * order.first.x - order.last.x * order.first.y;
    order.cos_between = order.last.x * order.first.x + order.last.y * order.first.y;
    return order;
}

// Minus half the angle between.
float2 sateen_half_back(SateenOrdered order) {
    float larger = sqrt(0.5 * (1.0 + abs(order.cos_between)));
    float smaller = 0.5 * max(order.sin_between, 0.0) / larger;
    return order.cos_between < 0.0 ? float2(smaller, -larger) : float2(larger, -smaller);
}

SateenSeen sateen_seen(SateenOrdered order, int arc) {
    SateenSeen seen;
    float4 ends = sateen_parameter(arc);
    float2 low = sateen_turned(order.first, ends.xy);
    float2 up = sateen_turned(order.last, ends.zw);
    bool is_from = low.x > 0.0;
    bool is_to = up.x > 0.0;
    float2 apart = float2(order.sin_between, order.cos_between);
    seen.first_a = sateen_visible(low);
    seen.last_b = sateen_visible(up);
    // Where one direction is at its horizon, the other is as far from there as they are apart.
    float2 last_a = sateen_turned(order.last, ends.xy);
    float2 first_b = sateen_turned(order.first, ends.zw);
    float2 last_apart = seen.first_a.y * float2(-apart.x, apart.y);
    float2 first_apart = seen.last_b.y * apart;
    seen.last_a = is_from ? last_a : last_apart;
    seen.first_b = is_to ? first_b : first_apart;
    float of_first = sateen_half_tangent(seen.first_a, seen.first_b);
    float of_last = sateen_half_tangent(seen.last_a, seen.last_b);
    float narrowed = is_to ? of_first : of_last;
    seen.half_tangent = is_from && is_to ? sateen_parameter(arc + 1).x : narrowed;
    return seen;
}

// Integral of max(cos(psi + delta), 0) over an arc.
float sateen_arc_projection(int arc, float2 psi) {
    float4 ends = sateen_parameter(arc);
    float2 a = sateen_turned(psi, ends.xy);
    float2 b = sateen_turned(psi, ends.zw);
    bool is_whole = a.x > 0.0 && b.x > 0.0;
    a = sateen_visible(a);
    b = sateen_visible(b);
    float half_tangent = is_whole ? sateen_parameter(arc + 1).x : sateen_half_tangent(a, b);
    return half_tangent * (a.x + b.x);
}

// atan T − T/(1 + T²).
float sateen_angle_beyond_sine(float t) {
    float t2 = t * t;
    float series = t * t2 * (2.0 / 3.0 - t2 * (4.0 / 5.0 - t2 * (6.0 / 7.0)));
    float closed = sateen_atan2(t, 1.0) - t / (1.0 + t2);
    return t < 0.1 ? series : closed;
}

// Integral of P over the tilts of an arc.
float sateen_joint_integral(SateenOrdered order, SateenSeen seen, float u) {
    float t = seen.half_tangent;
    float sums = (seen.first_a.x + seen.first_b.x) * (seen.last_a.x + seen.last_b.x);
    float product = 0.5 * t * sums + order.cos_between * sateen_angle_beyond_sine(t);
    float2 turn = sateen_half_back(order);
    float falling = min(max(sateen_half_tangent(seen.first_a, turn), 0.0), t);
    float rising = (t - falling) / (1.0 + t * falling);
    float first_turn = falling < t ? turn.x : seen.first_b.x;
    float last_turn = falling > 0.0 ? turn.x : seen.last_a.x;
    float smaller = falling * (seen.first_a.x + first_turn) + rising * (last_turn + seen.last_b.x);
    return t > 0.0 ? max((1.0 - u) * product + u * smaller, 0.0) : 0.0;
}

// S and V of a thread's single tilts. `parts` are its first tilt, how many, its first arc, how many.
float2 sateen_response_of_tilts(SateenPair pair, float4 optics, float4 parts) {
    float2 response = float2(0.0, 0.0);
    int count = int(parts.y);
    for (int k = 0; k < count; k++) {
        float4 tilt = sateen_parameter(int(parts.x) + k);
        response += tilt.z * sateen_response(pair, optics, tilt.xy);
    }
    return response;
}

// What Q sums of a thread: the mean projection towards the viewer.
float sateen_projection(float2 psi, float4 parts) {
    float sum = 0.0;
    int arcs = int(parts.w);
    for (int k = 0; k < arcs; k++) {
        int arc = int(parts.z) + 2 * k;
        sum += sateen_parameter(arc + 1).y * sateen_arc_projection(arc, psi);
    }
    int tilts = int(parts.y);
    for (int k = 0; k < tilts; k++) {
        float4 tilt = sateen_parameter(int(parts.x) + k);
        sum += tilt.z * max(sateen_facing(psi, tilt.xy), 0.0);
    }
    return sum;
}

// The same by both directions.
float sateen_joint_projection(SateenPair pair, float4 parts) {
    SateenOrdered order = sateen_order(pair);
    float sum = 0.0;
    int arcs = int(parts.w);
    for (int k = 0; k < arcs; k++) {
        int arc = int(parts.z) + 2 * k;
        float mean = sateen_joint_integral(order, sateen_seen(order, arc), pair.u_psi);
        sum += sateen_parameter(arc + 1).y * mean;
    }
    int tilts = int(parts.y);
    for (int k = 0; k < tilts; k++) {
        float4 tilt = sateen_parameter(int(parts.x) + k);
        sum += tilt.z * sateen_visibility(pair, tilt.xy);
    }
    return sum;
}

// ---- Placed nodes: src/brdf/placed.rs

struct SateenHighlight {
    SateenOrdered order;
    // Of the first and the last direction.
    float2 radii;
    float2 sides;
    float h;
    // (cos, sin) of psi_H.
    float2 turn;
    float low;
    float up;
    float width;
};

struct SateenEnd {
    float q;
    float over;
    float t;
    float stretch;
};

struct SateenSums {
    float surface;
    float lobe;
    float isotropic;
    float surface_area;
    float volume_area;
};

// 1 − erf|x| to 3e-7: M. Abramowitz, I. Stegun, Handbook of Mathematical Functions, 1964, 7.1.28.
float sateen_erfc_abs(float x) {
    float a = min(abs(x), 10.0);
    float sum = 0.0000430638 * a;
    sum = (sum + 0.0002765672) * a;
    sum = (sum + 0.0001520143) * a;
    sum = (sum + 0.0092705272) * a;
    sum = (sum + 0.0422820123) * a;
    sum = (sum + 0.0705230784) * a;
    float r = 1.0 / (1.0 + sum);
    float r2 = r * r;
    float r4 = r2 * r2;
    float r8 = r4 * r4;
    return r8 * r8;
}

// The lobe's area over what the nodes make of it; 1 where the segment is narrow against the lobe.
float sateen_exactness(float gamma, float theta_a, float theta_b, float summed) {
    float k = 0.707106781 / gamma;
    float rest_a = sateen_erfc_abs(k * theta_a);
    float rest_b = sateen_erfc_abs(k * theta_b);
    bool is_across = theta_a < 0.0 && theta_b > 0.0;
    float area = 0.5 * (is_across ? 2.0 - rest_a - rest_b : abs(rest_a - rest_b));
    bool is_narrow = theta_b - theta_a < 0.25 * gamma;
    return is_narrow ? 1.0 : area / (max(summed, 0.0) + SATEEN_TINY);
}

// q at which a direction with |x'| = x and z' = z passes behind the thread.
float sateen_horizon(float x, float z) {
    return min(z / (sateen_norm2(x, z) + x + SATEEN_TINY), 1.0);
}

SateenHighlight sateen_highlight(SateenPair pair, float4 optics, float half_reach) {
    SateenHighlight highlight;
    highlight.order = sateen_order(pair);
    bool is_swapped = highlight.order.is_swapped;
    highlight.radii = is_swapped ? float2(pair.r_r, pair.r_i) : float2(pair.r_i, pair.r_r);
    highlight.sides = is_swapped ? float2(pair.wr.y, pair.wi.y) : float2(pair.wi.y, pair.wr.y);
    float2 h = float2(pair.wi.z + pair.wr.z, pair.wi.x + pair.wr.x);
    highlight.h = max(length(h), SATEEN_TINY);
    highlight.turn = h / highlight.h;
    float x = abs(highlight.turn.x * pair.wi.x - highlight.turn.y * pair.wi.z);
    float z_i = highlight.turn.x * pair.wi.z + highlight.turn.y * pair.wi.x;
    float z_r = highlight.turn.x * pair.wr.z + highlight.turn.y * pair.wr.x;
    highlight.low = -sateen_horizon(x, is_swapped ? z_r : z_i);
    highlight.up = sateen_horizon(x, is_swapped ? z_i : z_r);
    float slope = highlight.h / (2.0 * max(sateen_norm2(pair.wi.y, z_i), 1e-6));
    highlight.width = half_reach * min(optics.z, optics.w) / max(slope, 1e-3);
    return highlight;
}

// q of a tilt, within what is visible.
float sateen_q(SateenHighlight highlight, float2 delta) {
    float2 beta = sateen_turned(highlight.turn, delta);
    float under = 1.0 + beta.x;
    // Near ±180°, where nothing is visible, it is enough that q is beyond ±1.
    float q = beta.y / (under < 1e-6 ? max(0.5 * abs(beta.y), SATEEN_TINY) : under);
    return max(min(q, highlight.up), highlight.low);
}

float sateen_theta_h(SateenHighlight highlight, float q, float first, float last) {
    float cos_sum = sateen_norm2(highlight.sides.x, highlight.radii.x * first)
        + sateen_norm2(highlight.sides.y, highlight.radii.y * last);
    float x_sum = highlight.h * 2.0 * q * (1.0 / (1.0 + q * q));
    return sateen_atan2(x_sum, max(cos_sum, SATEEN_TINY));
}

SateenEnd sateen_end(float q, float width) {
    SateenEnd end;
    float x = q / width;
    end.q = q;
    end.over = 1.0 / (1.0 + q * q);
    end.stretch = 0.5 * (1.0 + sqrt(1.0 + 4.0 * x * x));
    end.t = x / end.stretch;
    return end;
}

// cos and sin of what the tilt differs from that at the end a `distance` in q away, at q; `over` is 1/(1 + q²).
float2 sateen_end_turn(SateenEnd end, float q, float over, float distance) {
    float c = 1.0 + q * end.q;
    float s = distance;
    return float2(c * c - s * s, 2.0 * c * s) * (over * end.over);
}

// What the nodes make of a segment between two ends in q.
SateenSums sateen_sum(SateenPair pair, float4 optics, SateenHighlight highlight, SateenSeen seen, float2 q_ends, float width, float2 nodes) {
    SateenSums sums;
    sums.surface = 0.0;
    sums.lobe = 0.0;
    sums.isotropic = 0.0;
    sums.surface_area = 0.0;
    sums.volume_area = 0.0;
    SateenEnd a = sateen_end(q_ends.x, width);
    SateenEnd b = sateen_end(q_ends.y, width);
    // t_b − t_a: where the ends are close together, from the width that is seen.
    float product = 1.0 + a.q * b.q;
    float apart = b.q - a.q < 0.5 * product ? seen.half_tangent * product : b.q - a.q;
    float close = apart / (width * a.stretch * b.stretch * (1.0 + a.t * b.t));
    float half_length = 0.5 * max(b.t - a.t < 0.5 ? close : b.t - a.t, 0.0);
    // 1 + t and 1 − t, which are small beside a narrow highlight.
    float above = a.t < 0.0 ? 1.0 / (a.stretch * (1.0 - a.t)) : 1.0 + a.t;
    float below = b.t > 0.0 ? 1.0 / (b.stretch * (1.0 + b.t)) : 1.0 - b.t;
    int count = int(nodes.y);
    for (int k = 0; k < count; k++) {
        float4 node = sateen_parameter(int(nodes.x) + k);
        float from_a = half_length * (1.0 + node.x);
        float to_b = half_length * (1.0 - node.x);
        float up = above + from_a;
        float down = below + to_b;
        float t = 0.5 * (up - down);
        float stretch = 1.0 / (up * down);
        float q = width * t * stretch;
        float over = 1.0 / (1.0 + q * q);
        float jacobian = (1.0 + t * t) * stretch * stretch * over;
        float weight = 2.0 * half_length * width * node.y * jacobian;

        // Each direction is turned from the end where it may be at its horizon: its cosine is small there.
        float distance = width * stretch;
        float2 turn_a = sateen_end_turn(a, q, over, distance * a.stretch * from_a * (1.0 + t * a.t));
        float first = sateen_facing(seen.first_a, turn_a);
        float2 turn_b = sateen_end_turn(b, q, over, distance * b.stretch * to_b * (1.0 + t * b.t));
        float last = seen.last_b.x * turn_b.x + seen.last_b.y * turn_b.y;
        float p_i = highlight.order.is_swapped ? last : first;
        float p_r = highlight.order.is_swapped ? first : last;

        float x_sum = highlight.h * 2.0 * q * over;
        SateenScattered parts = sateen_scatter(pair, optics, p_i, p_r, x_sum);
        sums.surface += weight * parts.surface;
        sums.lobe += weight * parts.lobe;
        sums.isotropic += weight * parts.isotropic;
        sums.surface_area += weight * parts.slope * parts.surface_lobe;
        sums.volume_area += weight * parts.slope * parts.volume_lobe;
    }
    return sums;
}

// Integral of S and V over a segment. `placed` has c/2, is stiff, surface lobe is wide, volume lobe is wide.
float2 sateen_segment(SateenPair pair, float4 optics, SateenHighlight highlight, int segment, float2 nodes, float4 placed) {
    SateenSeen seen = sateen_seen(highlight.order, segment);
    float4 ends = sateen_parameter(segment);
    float2 q_ends = float2(sateen_q(highlight, ends.xy), sateen_q(highlight, ends.zw));
    float theta_a = sateen_theta_h(highlight, q_ends.x, seen.first_a.x, seen.last_a.x);
    float theta_b = sateen_theta_h(highlight, q_ends.y, seen.first_b.x, seen.last_b.x);
    SateenSums near_sums = sateen_sum(pair, optics, highlight, seen, q_ends, highlight.width, nodes);
    SateenSums of_surface = near_sums;
    SateenSums of_volume = near_sums;
    float isotropic = near_sums.isotropic;
    if (placed.y > 0.5) {
        float narrower = min(optics.z, optics.w);
        float wider = max(optics.z, optics.w);
        float width = placed.z + placed.w > 0.5 ? highlight.width * wider / narrower : 4.0;
        SateenSums wide = sateen_sum(pair, optics, highlight, seen, q_ends, width, nodes);
        if (placed.z > 0.5) {
            of_surface = wide;
        }
        if (placed.w > 0.5) {
            of_volume = wide;
        }
        isotropic = wide.isotropic;
    }
    float surface = of_surface.surface
        * sateen_exactness(optics.z, theta_a, theta_b, of_surface.surface_area);
    float lobe = of_volume.lobe
        * sateen_exactness(optics.w, theta_a, theta_b, of_volume.volume_area);
    return float2(surface, lobe + isotropic);
}

// S and V of a thread's segments. `parts` are its first segment, how many, its first node, how many.
float2 sateen_mean_response(SateenPair pair, float4 optics, float4 parts, float4 placed) {
    float2 response = float2(0.0, 0.0);
    SateenHighlight highlight = sateen_highlight(pair, optics, placed.x);
    int count = int(parts.y);
    for (int k = 0; k < count; k++) {
        int segment = int(parts.x) + 2 * k;
        float density = sateen_parameter(segment + 1).y;
        response += density * sateen_segment(pair, optics, highlight, segment, parts.zw, placed);
    }
    return response;
}

// ---- Charts: src/chart

// value/range in ±1 as a coordinate in 0 … 1; a half where the range is empty.
float sateen_normalized(float value, float range) {
    float normalized = clamp(0.5 + 0.5 * value / max(range, SATEEN_TINY), 0.0, 1.0);
    return range > 0.0 ? normalized : 0.5;
}

// How high above a thread's horizon a direction is.
float sateen_height(float3 w) {
    return min(w.z / max(sateen_norm2(w.y, w.z), SATEEN_TINY), 1.5 * w.z);
}

// The share of a box that ends a `rim` before the horizon in the value of a pair.
float sateen_share_of_box(float rim, float3 wi, float3 wr) {
    float height = min(sateen_height(wi), sateen_height(wr));
    return rim > 0.0 ? clamp((height - rim) / SATEEN_BAND, 0.0, 1.0) : 1.0;
}

// `chart` is the first of a grid's parameters.
float4 sateen_thread_coordinates(float4 chart, float rim, float3 wi, float3 wr) {
    bool is_away = chart.y > 0.5 && wi.x + wr.x < 0.0;
    float x_i = is_away ? -wi.x : wi.x;
    float x_r = is_away ? -wr.x : wr.x;
    float theta_i = sateen_atan2(x_i, sateen_norm2(wi.y, wi.z));
    float theta_r = sateen_atan2(x_r, sateen_norm2(wr.y, wr.z));
    float phi_i = sateen_atan2(wi.y, wi.z);
    float phi_r = sateen_atan2(wr.y, wr.z);
    float theta_h = 0.5 * (theta_i + theta_r);
    float theta_d = 0.5 * (theta_i - theta_r);
    float phi_h = 0.5 * (phi_i + phi_r);
    float phi_d = phi_i - phi_r;
    float side = phi_h < 0.0 ? -1.0 : 1.0;
    phi_d = side * phi_d;
    phi_h = abs(phi_h);

    float psi = sateen_atan2(x_i + x_r, wi.z + wr.z);
    float half_pi = 0.5 * SATEEN_PI;
    float u0 = sateen_normalized(chart.x < 0.5 ? theta_h : psi, half_pi);
    float u1 = sateen_normalized(theta_d, half_pi - abs(theta_h));
    float u2 = sateen_normalized(phi_d, 2.0 * (half_pi - rim) - 2.0 * phi_h);
    float u3 = min(phi_h / (half_pi - rim), 1.0);
    if (chart.z < 0.5) {
        u2 = side < 0.0 ? 1.0 - u2 : u2;
        u3 = 0.5 + 0.5 * side * u3;
    }
    return float4(u0, u1, u2, u3);
}

float4 sateen_isotropic_coordinates(float3 wi, float3 wr) {
    float theta_i = sateen_atan2(sateen_norm2(wi.x, wi.y), wi.z);
    float theta_r = sateen_atan2(sateen_norm2(wr.x, wr.y), wr.z);
    float sum = theta_i + theta_r;
    float range = min(sum, SATEEN_PI - sum);
    float cross_z = wi.x * wr.y - wi.y * wr.x;
    float azimuth = sateen_atan2(abs(cross_z), wi.x * wr.x + wi.y * wr.y);
    float u0 = clamp(sum / SATEEN_PI, 0.0, 1.0);
    float u1 = sateen_normalized(theta_i - theta_r, range);
    return float4(u0, u1, min(azimuth / SATEEN_PI, 1.0), 0.0);
}

float4 sateen_view_coordinates(float4 chart, float3 wr) {
    float theta = sateen_atan2(sateen_norm2(wr.x, wr.y), wr.z);
    float phi = sateen_atan2(wr.y, wr.x);
    float u0 = clamp(theta / (0.5 * SATEEN_PI), 0.0, 1.0);
    return float4(u0, chart.z > 0.5 ? 0.0 : sateen_normalized(phi, SATEEN_PI), 0.0, 0.0);
}

// ---- Grids: src/volume

// u in nodes. `axis` has the first warp, how many pieces, nodes − 1.
float sateen_warp(float4 axis, float u) {
    int piece = int(clamp(u * axis.y, 0.0, axis.y - 1.0));
    float4 two = sateen_parameter(int(axis.x) + piece / 2);
    float2 straight = piece % 2 == 0 ? two.xy : two.zw;
    return clamp(straight.x + straight.y * u, 0.0, axis.z);
}

// S and V of the grid whose parameters begin there: one fetch.
float2 sateen_grid(int grid, float3 wi, float3 wr) {
    float4 chart = sateen_parameter(grid);
    float4 last_axis = sateen_parameter(grid + 5);
    float4 u;
    if (chart.x < 1.5) {
        u = sateen_thread_coordinates(chart, last_axis.w, wi, wr);
    } else if (chart.x < 2.5) {
        u = sateen_isotropic_coordinates(wi, wr);
    } else {
        u = sateen_view_coordinates(chart, wr);
    }
    float t0 = sateen_warp(sateen_parameter(grid + 2), u.x);
    float t1 = sateen_warp(sateen_parameter(grid + 3), u.y);
    float t2 = sateen_warp(sateen_parameter(grid + 4), u.z);
    float t3 = sateen_warp(last_axis, u.w);
    // What 1 stands for in S and V, nodes of u₂ and u₃.
    float4 scale = sateen_parameter(grid + 1);
    float slab = max(min(floor(t3), scale.w - 2.0), 0.0);
    float3 size = sateen_parameter(1).xyz;
    float3 texel = float3(t0, t1, chart.w + scale.z * slab + t2) + 0.5;
    float4 two = sateen_volume(texel / size);
    float2 roots = lerp(two.xy, two.zw, t3 - slab);
    return scale.xy * roots * roots;
}

// ---- Cloth

// Surface to thread coordinates. `frame` has cos α, sin α.
float3 sateen_to_thread(float4 frame, float3 w) {
    return float3(w.x * frame.x + w.y * frame.y, w.y * frame.x - w.x * frame.y, w.z);
}

// S, V and the projection of a thread.
float3 sateen_thread_response(int thread, float3 wi, float3 wr) {
    // cos α, sin α, coverage, kind.
    float4 frame = sateen_parameter(thread);
    float3 thread_wi = sateen_to_thread(frame, wi);
    float3 thread_wr = sateen_to_thread(frame, wr);
    float4 grids = sateen_parameter(thread + 6);
    if (frame.w > 2.5) {
        float2 response = sateen_grid(int(grids.x), thread_wi, thread_wr);
        float2 projection = sateen_grid(int(grids.y), thread_wi, thread_wr);
        return float3(response, projection.x);
    }
    float4 head = sateen_parameter(0);
    float4 optics = sateen_parameter(thread + 2);
    float4 parts = sateen_parameter(thread + 3);
    SateenPair pair = sateen_thread_pair(thread_wi, thread_wr, head.y);
    float2 response = sateen_response_of_tilts(pair, optics, parts);
    // That of a grid in the segments.
    float share = 0.0;
    if (frame.w > 0.5 && frame.w < 1.5) {
        share = sateen_share_of_box(sateen_parameter(int(grids.x) + 5).w, thread_wi, thread_wr);
    }
    if (frame.w > 0.5 && share < 1.0) {
        float4 segments = sateen_parameter(thread + 4);
        float4 placed = sateen_parameter(thread + 5);
        response += (1.0 - share) * sateen_mean_response(pair, optics, segments, placed);
    }
    if (share > 0.0) {
        response += share * sateen_grid(int(grids.x), thread_wi, thread_wr);
    }
    float projection;
    if (head.w > 0.5) {
        projection = sateen_joint_projection(pair, parts);
    } else {
        projection = sateen_projection(pair.psi_r, parts);
    }
    return float3(response, projection);
}

// The same by the thesis' rule: the mean over n midpoints of equal length. What changes its direction is in grids alone and
// evaluated by them.
float3 sateen_direct_response(int thread, float3 wi, float3 wr, int n) {
    float4 frame = sateen_parameter(thread);
    if (frame.w > 2.5) {
        return sateen_thread_response(thread, wi, wr);
    }
    float3 thread_wi = sateen_to_thread(frame, wi);
    float3 thread_wr = sateen_to_thread(frame, wr);
    float4 head = sateen_parameter(0);
    float4 optics = sateen_parameter(thread + 2);
    float4 parts = sateen_parameter(thread + 3);
    SateenPair pair = sateen_thread_pair(thread_wi, thread_wr, head.y);
    int tilts = int(parts.y);
    int count = tilts + int(parts.w);
    int next = 0;
    float start = 0.0;
    float end = 0.0;
    float low = 0.0;
    float up = 0.0;
    float3 sum = float3(0.0, 0.0, 0.0);
    for (int k = 0; k < n; k++) {
        float place = (float(k) + 0.5) / float(n);
        // The tilt or arc that the place is in.
        while (next < count && place >= end) {
            start = end;
            if (next < tilts) {
                float4 tilt = sateen_parameter(int(parts.x) + next);
                low = tilt.w;
                up = tilt.w;
                end += tilt.z;
            } else {
                float4 arc = sateen_parameter(int(parts.z) + 2 * (next - tilts) + 1);
                low = arc.z;
                up = arc.w;
                end += arc.y * (arc.w - arc.z);
            }
            next++;
        }
        float angle = low + (up - low) * clamp((place - start) / max(end - start, SATEEN_TINY), 0.0, 1.0);
        float2 delta = float2(cos(angle), sin(angle));
        float seen = max(sateen_facing(pair.psi_r, delta), 0.0);
        if (head.w > 0.5) {
            seen = sateen_visibility(pair, delta);
        }
        sum += float3(sateen_response(pair, optics, delta), seen);
    }
    return sum / float(n);
}

// Linear RGB of the first four threads.
struct SateenAlbedos {
    float3 of_thread[4];
};

// The fabric's own.
SateenAlbedos sateen_albedos() {
    SateenAlbedos albedos;
    int count = int(sateen_parameter(1).w);
    for (int k = 0; k < 4; k++) {
        int thread = SATEEN_HEADER + SATEEN_THREAD * min(k, max(count - 1, 0));
        albedos.of_thread[k] = sateen_parameter(thread + 1).xyz;
    }
    return albedos;
}

// ρ with n midpoints, or by the lookup if n is 0.
float3 sateen_weave(float3 wi, float3 wr, SateenAlbedos albedos, int n) {
    if (!(wi.z > 0.0 && wr.z > 0.0)) {
        return float3(0.0, 0.0, 0.0);
    }
    float4 head = sateen_parameter(0);
    float q = head.x * wr.z;
    float3 sum = float3(0.0, 0.0, 0.0);
    int count = int(sateen_parameter(1).w);
    for (int k = 0; k < count; k++) {
        int thread = SATEEN_HEADER + SATEEN_THREAD * k;
        float3 response;
        if (n > 0) {
            response = sateen_direct_response(thread, wi, wr, n);
        } else {
            response = sateen_thread_response(thread, wi, wr);
        }
        float3 albedo = sateen_parameter(thread + 1).xyz;
        if (k < 4) {
            albedo = albedos.of_thread[k];
        }
        float coverage = sateen_parameter(thread).z;
        q += coverage * response.z;
        sum += coverage * (response.x + response.y * albedo);
    }
    // Where nothing of the cloth faces the viewer, nothing is seen.
    return q > 0.0 ? clamp(head.z * sum / max(q, SATEEN_TINY), 0.0, 3.0e38) : float3(0.0, 0.0, 0.0);
}

// ρ = BRDF × cosine [1/sr], with other albedos.
float3 sateen_eval_cos_with(float3 wi, float3 wr, SateenAlbedos albedos) {
    return sateen_weave(wi, wr, albedos, 0);
}

// The BRDF [1/sr], with other albedos.
float3 sateen_eval_with(float3 wi, float3 wr, SateenAlbedos albedos) {
    return min(sateen_eval_cos_with(wi, wr, albedos) / max(wi.z, SATEEN_TINY), 3.0e38);
}

// ρ = BRDF × cosine [1/sr], with the fabric's own albedo.
float3 sateen_eval_cos(float3 wi, float3 wr) {
    return sateen_eval_cos_with(wi, wr, sateen_albedos());
}

// The BRDF [1/sr], with the fabric's own albedo.
float3 sateen_eval(float3 wi, float3 wr) {
    return sateen_eval_with(wi, wr, sateen_albedos());
}

// ρ by direct integration with n midpoints per thread, for n closed forms; the thesis takes 50.
float3 sateen_direct_cos(float3 wi, float3 wr, int n) {
    return sateen_weave(wi, wr, sateen_albedos(), max(n, 1));
}
