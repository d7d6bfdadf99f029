// A planar arm as it moves, in SVG. No libraries.
'use strict';

class PlanarArm extends Player {
  constructor(spec, parent, tell) {
    super(spec, parent, tell, 'The arm in motion, links as they bend');
  }

  addShapes() {
    const [left, low, width, height] = this.spec.box;
    this.unit = Math.max(width, height) / 100;
    this.svg = drawing('svg', this.figure, {
      viewBox: `${left} ${-low - height} ${width} ${height}`, role: 'img',
      'aria-label': 'The arm in motion' });
    // y upwards
    this.plane = drawing('g', this.svg, { transform: 'scale(1, -1)', fill: 'none',
      'stroke-linejoin': 'round', 'stroke-linecap': 'round' });
    this.addStill();
    this.addMoving();
  }

  line(points, colour, width) {
    return drawing('polyline', this.plane, {
      points: points.join(' '), stroke: colour, 'stroke-width': width * this.unit });
  }

  dot(colour, size) {
    return drawing('circle', this.plane, { r: size * this.unit, fill: colour });
  }

  // What does not move: the arm at both ends, the path of the tip, the base, what is kept free.
  addStill() {
    const { links, tip, colours, keep_outs: regions } = this.spec;
    for (const region of regions) {
      drawing('polygon', this.plane, { points: region.join(' '), fill: colours.refused,
        'fill-opacity': 0.3 });
    }
    for (const frame of [links[0], links[links.length - 1]]) {
      for (const link of frame) this.line(link, colours.aside, 0.6);
    }
    this.path = this.line(tip, colours.tip, 0.25);
    this.path.setAttribute('stroke-dasharray', `${this.unit} ${this.unit}`);
    const size = 1.6 * this.unit;
    drawing('rect', this.plane, { x: -size, y: -size, width: 2 * size, height: 2 * size,
      fill: colours.rigid });
  }

  addMoving() {
    const { links, flexible, colours, loaded } = this.spec;
    this.links = links[0].map((link, i) => this.line(link,
      flexible[i] ? colours.flexible : colours.rigid, 1.1));
    this.joints = links[0].map(() => drawing('circle', this.plane, {
      r: this.unit, fill: '#fff', stroke: colours.rigid, 'stroke-width': 0.4 * this.unit }));
    this.payload = this.dot(colours.tip, loaded ? 1.6 : 0.8);
  }

  pose(low, high, share) {
    const { links, payload } = this.spec;
    links[low].forEach((link, i) => {
      const points = between(link, links[high][i], share);
      this.links[i].setAttribute('points', points.join(' '));
      this.put(this.joints[i], points);
    });
    this.put(this.payload, between(payload[low], payload[high], share));
  }

  put(mark, [x, y]) {
    mark.setAttribute('cx', x);
    mark.setAttribute('cy', y);
  }
}
