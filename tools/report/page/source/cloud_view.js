// The cloud and the trajectories in 3D. Created on demand, because the view requires WebGL.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  MOUSE,
  PerspectiveCamera,
  Plane,
  Points,
  PointsMaterial,
  SRGBColorSpace,
  Scene,
  TOUCH,
  Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { Line2 } from 'three/examples/jsm/lines/Line2.js';
import { LineGeometry } from 'three/examples/jsm/lines/LineGeometry.js';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import { h, onResize } from './dom.js';
import { driveBox } from './plan.js';
import { color, isDark, onTheme, seriesColor, vivid } from './theme.js';

export function cloudView(state, cloud) {
  const { run } = state;
  const canvas = h('canvas', {
    tabindex: 0,
    'data-chart': 'cloud',
    role: 'img',
    'aria-label': 'Cloud and trajectories in 3D. Drag to rotate, arrows to move, wheel to zoom.',
  });
  const element = h('div', { class: 'view', hidden: true }, canvas);
  const box = driveBox(run);
  const middle = ['x', 'y', 'z'].map((axis) => 0.5 * (box[axis][0] + box[axis][1]));
  const reach = Math.max(10, Math.hypot(box.x[1] - box.x[0], box.y[1] - box.y[0]));
  let three = null;
  let cut = Infinity;
  let failed = null;

  const heightFor = (width) => Math.round(Math.min(Math.max(360, 0.5 * width), 620));

  function points() {
    const positions = new Float32Array(3 * cloud.x.length);
    for (let i = 0; i < cloud.x.length; ++i) {
      // Relative to the middle of the drive, single precision is accurate to micrometres for any origin of the map.
      positions.set([cloud.x[i] - middle[0], cloud.y[i] - middle[1], cloud.z[i] - middle[2]], 3 * i);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(positions, 3));
    geometry.setAttribute('color', new BufferAttribute(new Float32Array(positions.length), 3));
    const material = new PointsMaterial({
      size: 1.6 * devicePixelRatio,
      sizeAttenuation: false,
      vertexColors: true,
      transparent: true,
      opacity: 0.75,
      clippingPlanes: [three.plane],
    });
    return new Points(geometry, material);
  }

  /** Colours by height, over the shown heights. */
  function paint() {
    const colors = three.cloud.geometry.getAttribute('color');
    const span = Math.max(0.1, Math.min(cloud.high, cut) - cloud.low);
    const table = Array.from({ length: 256 }, (_, i) => {
      // Without the darkest colours, which are invisible on a dark background.
      const [red, green, blue] = vivid(0.15 + (0.85 * i) / 255);
      return new Color().setRGB(red / 255, green / 255, blue / 255, SRGBColorSpace);
    });
    for (let i = 0; i < cloud.z.length; ++i) {
      const { r, g, b } = table[Math.round(255 * Math.min(1, Math.max(0, (cloud.z[i] - cloud.low) / span)))];
      colors.setXYZ(i, r, g, b);
    }
    colors.needsUpdate = true;
  }

  function line({ x, y, z }, paint, width) {
    const places = [];
    for (let i = 0; i < x.length; ++i) {
      // Lines are slightly above the floor, so that the floor does not hide them.
      if (x[i] != null) places.push(x[i] - middle[0], y[i] - middle[1], z[i] - middle[2] + 0.05);
    }
    // Transparent objects are drawn after the cloud: walls never hide trajectories.
    const material = new LineMaterial({
      color: new Color(paint),
      linewidth: width,
      transparent: true,
      depthTest: false,
    });
    return new Line2(new LineGeometry().setPositions(places), material);
  }

  function render() {
    if (three && !element.hidden) three.renderer.render(three.scene, three.camera);
  }

  function lines() {
    three.tracks.forEach((track) => {
      three.scene.remove(track);
      track.geometry.dispose();
    });
    three.tracks = [];
    const add = (series, paint, width) => {
      if (series.x.filter((value) => value != null).length < 2) return;
      const track = line(series, paint, width);
      track.renderOrder = three.tracks.length + 1;
      three.tracks.push(track);
      three.scene.add(track);
    };
    if (run.truth) add(run.truth, color('truth'), 6);
    run.estimators.forEach(
      (one, i) => state.isShown(one.name) && add(one.series, seriesColor(one.color), Math.max(1.4, 4 - 1.2 * i)),
    );
    three.renderer.setClearColor(isDark() ? 0x14181c : 0xffffff);
    render();
  }

  function make() {
    const renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    renderer.setPixelRatio(devicePixelRatio);
    renderer.localClippingEnabled = true;
    const camera = new PerspectiveCamera(45, 1, 0.1, 20 * reach + 500);
    camera.up.set(0, 0, 1);
    // Perpendicular to the longest side of the drive, at a distance with all of it in view.
    const away = new Vector3(0, -1, 0.7);
    if (box.y[1] - box.y[0] > box.x[1] - box.x[0]) away.set(-1, 0, 0.7);
    camera.position.copy(away.normalize().multiplyScalar(0.5 * reach + 8));
    const farther = () => {
      camera.updateMatrixWorld();
      camera.lookAt(0, 0, 0);
      camera.updateMatrixWorld();
      return [0, 1].some((i) =>
        [0, 1].some((k) => {
          const corner = new Vector3(box.x[i] - middle[0], box.y[k] - middle[1], 0).project(camera);
          return Math.abs(corner.x) > 0.92 || Math.abs(corner.y) > 0.92;
        }),
      );
    };
    camera.aspect = Math.max(0.5, element.clientWidth / heightFor(element.clientWidth));
    camera.updateProjectionMatrix();
    for (let step = 0; step < 60 && farther(); ++step) camera.position.multiplyScalar(1.05);
    const controls = new OrbitControls(camera, canvas);
    controls.target = new Vector3(0, 0, 0);
    controls.mouseButtons = { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
    controls.touches = { ONE: TOUCH.ROTATE, TWO: TOUCH.DOLLY_PAN };
    controls.listenToKeyEvents(canvas);
    controls.addEventListener('change', render);
    three = {
      renderer,
      camera,
      controls,
      scene: new Scene(),
      tracks: [],
      plane: new Plane(new Vector3(0, 0, -1), 1e9),
    };
    if (cloud) {
      three.cloud = points();
      three.scene.add(three.cloud);
    }
    lines();
    setCut(cut);
    state.on('shown', lines);
    onTheme(lines);
    onResize(element, measure);
  }

  function measure() {
    const width = element.clientWidth;
    if (!three || width === 0) return;
    const height = heightFor(width);
    element.style.height = `${height}px`;
    three.renderer.setSize(width, height, false);
    three.camera.aspect = width / height;
    three.camera.updateProjectionMatrix();
    three.controls.update();
    render();
  }

  function setCut(height) {
    cut = height;
    if (!three) return;
    three.plane.constant = Number.isFinite(cut) ? cut - middle[2] : 1e9;
    if (cloud) paint();
    render();
  }

  return {
    element,
    setCut,
    show(visible) {
      element.hidden = !visible;
      if (!visible || failed) return;
      try {
        if (!three) make();
        measure();
        canvas.dataset.points = cloud?.x.length ?? 0;
      } catch (error) {
        failed = error;
        element.replaceChildren(
          h(
            'p',
            { class: 'notice' },
            'This browser has no WebGL for the 3D view; the cloud from above does not require WebGL.',
          ),
        );
      }
    },
  };
}
