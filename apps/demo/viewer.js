// Shows the model of a report in 3D, with what the page itself holds. Without this script or WebGL 2 its place stays
// hidden, and the pictures stand alone.
(() => {
  'use strict';
  const root = document.getElementById('view');
  const canvas = root.querySelector('canvas');
  const said = root.querySelector('[role=status]');
  const given = JSON.parse(document.getElementById('meshes').textContent);
  const gl = canvas.getContext('webgl2', {alpha: true, antialias: true});
  if (!gl) return;
  root.classList.remove('flat');

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const vertexText = `#version 300 es
    in vec3 place; in vec3 normal; in vec3 colour;
    uniform vec3 low, extent, centre;
    uniform mat3 turn;
    uniform vec4 lens;  // 1 / tan of half the angle over the width and the height, distance, radius
    out vec3 n, c, p;
    void main() {
      p = turn * (low + place * extent - centre) - vec3(0, 0, lens.z);
      n = turn * normal;
      c = colour;
      float near = max(lens.z - 1.1 * lens.w, 0.02 * lens.w), far = lens.z + 1.1 * lens.w;
      gl_Position = vec4(p.x * lens.x, p.y * lens.y, (-p.z * (far + near) - 2.0 * far * near) / (far - near), -p.z);
    }`;
  const fragmentText = `#version 300 es
    precision highp float;
    in vec3 n, c, p;
    out vec4 seen;
    void main() {
      vec3 up = normalize(gl_FrontFacing ? n : -n), eye = normalize(-p);
      vec3 key = normalize(vec3(-0.5, 0.7, 0.7)), fill = normalize(vec3(0.8, 0.1, 0.5));
      vec3 base = pow(c, vec3(2.2));
      float sky = 0.5 + 0.5 * up.y;
      vec3 light = vec3(0.16, 0.15, 0.14) + 0.22 * sky * vec3(0.9, 0.95, 1.0);
      light += max(dot(up, key), 0.0) * vec3(0.74, 0.70, 0.65) + max(dot(up, fill), 0.0) * vec3(0.20, 0.22, 0.26);
      float shine = pow(max(dot(up, normalize(key + eye)), 0.0), 40.0);
      seen = vec4(pow(base * light + 0.10 * shine, vec3(1.0 / 2.2)), 1.0);
    }`;

  let program, meshes, where;
  const shader = (kind, text) => {
    const made = gl.createShader(kind);
    gl.shaderSource(made, text);
    gl.compileShader(made);
    return made;
  };
  const attribute = (name, data, kind) => {
    const at = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, 3, kind, true, 0, 0);
  };
  const upload = (mesh) => {
    const array = gl.createVertexArray(), corners = bytes(mesh.corners);
    gl.bindVertexArray(array);
    attribute('place', bytes(mesh.places), gl.UNSIGNED_SHORT);
    attribute('normal', bytes(mesh.normals), gl.BYTE);
    attribute('colour', bytes(mesh.colours), gl.UNSIGNED_BYTE);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    return {array, count: corners.length / 2};
  };
  const prepare = () => {
    program = gl.createProgram();
    gl.attachShader(program, shader(gl.VERTEX_SHADER, vertexText));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER, fragmentText));
    gl.linkProgram(program);
    gl.useProgram(program);
    where = (name) => gl.getUniformLocation(program, name);
    meshes = {before: upload(given.before), after: upload(given.after)};
    gl.enable(gl.DEPTH_TEST);
  };

  // ---- The view
  const start = {yaw: given.azimuth, pitch: given.elevation, zoom: 1};
  const view = {...start, shown: 'after'};
  const extent = given.high.map((v, k) => v - given.low[k]);
  const centre = given.low.map((v, k) => v + extent[k] / 2);
  const radius = Math.hypot(...extent) / 2, half = Math.tan((15 * Math.PI) / 180);
  let waiting = false;
  const draw = () => {
    waiting = false;
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * scale));
    const height = Math.max(1, Math.round(canvas.clientHeight * scale));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const [a, b] = [(view.yaw * Math.PI) / 180, (view.pitch * Math.PI) / 180];
    const [ca, sa, cb, sb] = [Math.cos(a), Math.sin(a), Math.cos(b), Math.sin(b)];
    // Column by column: about the vertical axis, then towards the viewer.
    gl.uniformMatrix3fv(where('turn'), false, [ca, sb * sa, cb * sa, 0, cb, -sb, -sa, sb * ca, cb * ca]);
    gl.uniform3fv(where('low'), given.low);
    gl.uniform3fv(where('extent'), extent);
    gl.uniform3fv(where('centre'), centre);
    const narrow = Math.min(1, width / height);
    gl.uniform4f(where('lens'), (narrow * height) / width / half, narrow / half, (0.66 * radius) / half / view.zoom,
      radius);
    gl.bindVertexArray(meshes[view.shown].array);
    gl.drawElements(gl.TRIANGLES, meshes[view.shown].count, gl.UNSIGNED_SHORT, 0);
  };
  const ask = () => {
    if (!waiting) requestAnimationFrame(draw);
    waiting = true;
  };
  const turn = (yaw, pitch) => {
    view.yaw += yaw;
    view.pitch = Math.min(89, Math.max(-89, view.pitch + pitch));
    ask();
  };
  const zoom = (factor) => {
    view.zoom = Math.min(8, Math.max(0.5, view.zoom * factor));
    ask();
  };
  const buttons = [...root.querySelectorAll('button[data-show]')];
  const show = (name) => {
    view.shown = name;
    for (const button of buttons) button.setAttribute('aria-pressed', String(button.dataset.show === name));
    said.textContent = given.texts[name];
    ask();
  };
  const acts = {
    left: () => turn(-10, 0), right: () => turn(10, 0), up: () => turn(0, 10), down: () => turn(0, -10),
    near: () => zoom(1.2), far: () => zoom(1 / 1.2),
    start: () => (Object.assign(view, start), ask()),
    other: () => show(view.shown === 'after' ? 'before' : 'after'),
  };

  // ---- Mouse, touch, keys
  const fingers = new Map();
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, {x: event.clientX, y: event.clientY});
  });
  canvas.addEventListener('pointermove', (event) => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const before = fingers.size === 2 ? spread() : 0;
    const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
    [last.x, last.y] = [event.clientX, event.clientY];
    if (fingers.size === 2) zoom(spread() / Math.max(1, before));
    else turn(-0.4 * dx, 0.4 * dy);
  });
  for (const over of ['pointerup', 'pointercancel'])
    canvas.addEventListener(over, (event) => fingers.delete(event.pointerId));
  // The wheel scrolls the page until somebody has taken hold of the model.
  canvas.addEventListener('wheel', (event) => {
    if (document.activeElement !== canvas) return;
    event.preventDefault();
    zoom(Math.exp(-0.0015 * event.deltaY));
  }, {passive: false});
  const keys = {ArrowLeft: 'left', ArrowRight: 'right', ArrowUp: 'up', ArrowDown: 'down', '+': 'near', '=': 'near',
    '-': 'far', Home: 'start', ' ': 'other'};
  canvas.addEventListener('keydown', (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    acts[keys[event.key]]();
  });
  for (const button of root.querySelectorAll('button[data-act]'))
    button.addEventListener('click', acts[button.dataset.act]);
  for (const button of buttons) button.addEventListener('click', () => show(button.dataset.show));
  canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
  canvas.addEventListener('webglcontextrestored', () => (prepare(), ask()));
  new ResizeObserver(ask).observe(canvas);
  prepare();
  show('after');
})();
