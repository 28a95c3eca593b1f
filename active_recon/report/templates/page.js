'use strict';
(async () => {
  await plotlyLoaded();
  const drawn = JSON.parse(await inflated('drawn'));
  const config = { displayModeBar: false, responsive: true, scrollZoom: false };
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const still = matchMedia('(prefers-reduced-motion: reduce)');

  // Colours are named as the style sheet's variables, which have a light and a dark scheme.
  const resolved = (value) => {
    if (typeof value === 'string' && value.startsWith('--')) {
      return getComputedStyle(document.documentElement).getPropertyValue(value).trim();
    }
    if (Array.isArray(value)) return value.map(resolved);
    if (value === null || typeof value !== 'object') return value;
    return Object.fromEntries(Object.entries(value).map(([key, inner]) => [key, resolved(inner)]));
  };
  const axis = (own) => ({ gridcolor: '--rule', zeroline: false, linecolor: '--rule', ...own });
  const draw = (place, { data, layout }) => Plotly.react(place, resolved(data), resolved({
    paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)',
    font: { family: 'system-ui, sans-serif', size: 12.5, color: '--ink' },
    hoverlabel: { bgcolor: '--card', font: { color: '--ink' }, bordercolor: '--rule' },
    ...layout, ...(layout.xaxis && { xaxis: axis(layout.xaxis), yaxis: axis(layout.yaxis) }),
  }), config);

  const panels = [...document.querySelectorAll('.panel')].map((panel) => {
    const { scene, surface: painted, map, stages } = drawn.panels[panel.dataset.panel];
    const [grids, truth] = [scene.grids.map(unpacked), unpacked(scene.truth)];
    const place = panel.querySelector('.scene');
    const turn = panel.querySelector('.turn');
    const slider = panel.querySelector('input[type=range]');
    const own = slider.value; // the recorded threshold, which may lie beyond the slider's ends
    const self = { place, turning: !still.matches, visible: false, angle: 0.6, at: grids.length - 1 };

    const chosen = () => panel.querySelector('.after input:checked').value;
    const drawMesh = (mesh) => draw(place, {
      data: sceneTraces(mesh, scene.cameras, self.at), layout: { ...SCENE_LAYOUT,
        scene: { ...SCENE_LAYOUT.scene, camera: { eye: eyeAt(self.angle),
          center: { x: 0, y: 0, z: -0.08 } } } } });
    self.drawScene = () => {
      if (chosen() === 'colors') {
        panel.querySelector('.count').textContent = 'the surface after the last view, in the colours of the views';
        drawMesh(coloredMesh(painted));
        return;
      }
      const cells = chosen() === 'truth' ? truth : grids[self.at];
      const threshold = slider.value === own ? scene.threshold : Number(slider.value);
      const mesh = surface(cells ?? [], scene.side, chosen() === 'truth' ? 0.5 : threshold);
      panel.querySelector('output').textContent = threshold.toFixed(2);
      const fit = truth && cells && chosen() !== 'truth'
        ? ` · IoU ${overlap(cells, truth, threshold).toFixed(2)}` : '';
      panel.querySelector('.count').textContent = cells
        ? `${mesh.count} cells${chosen() === 'truth' ? ' of the true shape' : ''}${fit}`
        : 'no shape was recorded after this view';
      drawMesh(mesh);
    };
    self.drawRest = () => {
      const shown = map.data.filter((trace) => !trace.meta || trace.meta.of === self.at);
      draw(panel.querySelector('.map'), { data: shown, layout: map.layout });
      for (const chart of panel.querySelectorAll('[data-own=stages]')) draw(chart, stages);
    };
    self.setTurning = (on) => {
      self.turning = on;
      turn.textContent = on ? 'Pause' : 'Turn';
    };
    const choose = () => {
      if (chosen() === 'colors') self.at = grids.length - 1;
      else if (chosen() !== 'truth') self.at = Number(chosen());
      panel.querySelectorAll('.film li').forEach((item, i) => item.classList.toggle('chosen', i === self.at));
      self.drawScene();
      self.drawRest();
    };
    panel.querySelector('.after').addEventListener('change', choose);
    slider.addEventListener('input', self.drawScene);
    turn.addEventListener('click', () => self.setTurning(!self.turning));
    place.addEventListener('pointerdown', () => self.setTurning(false));
    new IntersectionObserver(([entry]) => { self.visible = entry.isIntersecting; }).observe(place);
    self.setTurning(self.turning);
    choose();
    return self;
  });

  const drawShared = () => document.querySelectorAll('[data-shared]').forEach(
    (chart) => draw(chart, drawn.shared[chart.dataset.shared]));
  drawShared();
  dark.addEventListener('change', () => {
    drawShared();
    for (const panel of panels) { panel.drawScene(); panel.drawRest(); }
  });

  let last = performance.now();
  const step = async (now) => {
    for (const panel of panels) {
      if (!panel.turning || !panel.visible || document.hidden) continue;
      panel.angle += Math.min(now - last, 100) * 0.00035;
      await Plotly.relayout(panel.place, { 'scene.camera.eye': eyeAt(panel.angle) });
    }
    last = now;
    requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
  document.documentElement.dataset.ready = 'yes';
})().catch((error) => {
  const trouble = document.getElementById('trouble');
  trouble.textContent = `The drawings failed: ${error.message}. A browser of 2023 or later is needed.`;
  trouble.hidden = false;
});
