'use strict';
// What the page contains compressed, by the id of its element: see embedding.py.
const inflated = async (id) => {
  const packed = Uint8Array.from(atob(document.getElementById(id).textContent),
    (letter) => letter.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Response(plain).text();
};
const plotlyLoaded = async () => {
  const script = document.createElement('script');
  script.textContent = await inflated('plotly');
  document.head.append(script);
};
