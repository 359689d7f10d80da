// The nearest position of a camera with all points in view and none behind a panel.

// Corners of the convex hull of points in the plane
function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const left = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0;
  const half = (list) => list.reduce((chain, point) => {
    while (chain.length > 1 && !left(chain.at(-2), chain.at(-1), point)) chain.pop();
    return [...chain, point];
  }, []).slice(0, -1);
  return [...half(sorted), ...half(sorted.reverse())];
}

// Whether a convex polygon touches a box, which is so if no line separates them
function touches(polygon, box) {
  const corners = [[box[0], box[1]], [box[2], box[1]], [box[2], box[3]], [box[0], box[3]]];
  const edges = polygon.map((point, i) => {
    const next = polygon[(i + 1) % polygon.length];
    return [next[1] - point[1], point[0] - next[0]];
  });
  return [[1, 0], [0, 1], ...edges].every((axis) => {
    const along = (point) => point[0] * axis[0] + point[1] * axis[1];
    const [a, b] = [polygon.map(along), corners.map(along)];
    return Math.max(...a) >= Math.min(...b) && Math.max(...b) >= Math.min(...a);
  });
}

// The nearest distance and position of a camera at which points (across, up, towards it) fill a part
// of the pane; both in the plane through `towards` = 0.
function fit(points, part, pane, fov) {
  const half = Math.tan((fov / 2) * (Math.PI / 180));
  const scale = [(half * pane.width) / pane.height, half];
  const bounds = [
    [(2 * part[0]) / pane.width - 1, (2 * part[2]) / pane.width - 1],
    [1 - (2 * part[3]) / pane.height, 1 - (2 * part[1]) / pane.height],
  ].map((range, i) => range.map((value) => value * scale[i]));
  // x - at <= high (distance - z) and x - at >= low (distance - z) for each point
  const extremes = bounds.map(([low, high], i) => [
    Math.min(...points.map((p) => p[i] + low * p[2])),
    Math.max(...points.map((p) => p[i] + high * p[2])),
  ]);
  const distance = Math.max(...bounds.map(([low, high], i) =>
    (extremes[i][1] - extremes[i][0]) / (high - low)));
  const at = bounds.map(([low, high], i) =>
    (extremes[i][0] - low * distance + extremes[i][1] - high * distance) / 2);
  const outline = () => hull(points.map((p) => {
    const [x, y] = [0, 1].map((i) => (p[i] - at[i]) / ((distance - p[2]) * scale[i]));
    return [((x + 1) / 2) * pane.width, ((1 - y) / 2) * pane.height];
  }));
  return { distance, at, outline };
}

// Candidate parts of the pane, between its edges and those of panels
function parts(taken, pane) {
  const gap = 22; // leaves room for axes and arrows
  const edges = (first, side, sign) => [...new Set([first, ...taken.map((box) => Math.round(box[side] + sign * gap))])];
  const [lefts, tops] = [edges(gap, 2, 1), edges(gap, 3, 1)];
  const [rights, bottoms] = [edges(pane.width - gap, 0, -1), edges(pane.height - gap, 1, -1)];
  return lefts.flatMap((left) => tops.flatMap((top) => rights.flatMap((right) => bottoms.map((bottom) => [left, top, right, bottom]))))
    .filter(([left, top, right, bottom]) => right - left > gap && bottom - top > gap);
}

// The nearest position of the camera from which no panel hides anything; if there is none, the one
// that fills the largest part without a panel.
function nearest(points, taken, pane, fov) {
  const choices = parts(taken, pane).map((part) => fit(points, part, pane, fov)).sort((a, b) => a.distance - b.distance);
  const free = ({ outline }) => {
    const polygon = outline();
    return !taken.some((box) => touches(polygon, box));
  };
  return choices.find(free) ?? fit(points, roomiest(taken, pane), pane, fov);
}

// The largest part of the pane without a panel, or else the whole pane
function roomiest(taken, pane) {
  const free = ([left, top, right, bottom]) => taken.every((box) => box[2] <= left || box[0] >= right || box[3] <= top || box[1] >= bottom);
  const area = ([left, top, right, bottom]) => (right - left) * (bottom - top);
  return parts(taken, pane).filter(free).reduce((best, part) => (!best || area(part) > area(best) ? part : best), null) ?? [0, 0, pane.width, pane.height];
}
