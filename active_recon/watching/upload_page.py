"""The page that a phone opens to send photos: one file without any other."""

PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>active_recon, photos</title>
<style nonce="NONCE">
:root { color-scheme: light dark; }
body { font: 17px/1.45 system-ui, sans-serif; margin: 0 auto; max-width: 30rem;
       overflow-wrap: anywhere; padding: 1rem; }
label { background: #2563a8; border-radius: .6rem; color: #fff; display: block; padding: 1rem;
        text-align: center; }
label:focus-within { outline: 3px solid #fac400; }
input { height: 1px; opacity: 0; position: absolute; width: 1px; }
img { background: #fcfcfc; border-radius: .6rem; display: block; margin: 1rem auto;
      max-width: 100%; }
#verdict { min-height: 1.5em; }
#lines p:first-child { font-weight: 600; }
button { background: none; border: 1px solid; border-radius: .6rem; color: inherit; display: block;
         font: inherit; margin: 1rem auto; padding: .6rem 1rem; }
[hidden] { display: none; }
</style>
<label>Take a photo<input id="photo" type="file" accept="image/*" capture="environment"></label>
<p id="verdict" role="status"></p>
<div id="lines"></div>
<img id="sketch" alt="From above: the board, the photos taken, and in yellow the next one" hidden>
<button id="skip" hidden>I cannot stand there</button>
<script nonce="NONCE">
const field = (name) => document.getElementById(name);
const say = (words) => { field('verdict').textContent = words; };
let busy = false, away = false, shown = '';
const show = (state) => {
  const text = JSON.stringify(state);
  if (text === shown) return;
  shown = text;
  field('lines').replaceChildren(...state.lines.map((line) => {
    const words = document.createElement('p');
    words.textContent = line;
    return words;
  }));
  field('sketch').hidden = !state.sketch;
  if (state.sketch) field('sketch').src = state.sketch;
  field('skip').hidden = !state.goal;
};
field('photo').addEventListener('change', async () => {
  const file = field('photo').files[0];
  if (!file) return;
  field('photo').value = ''; // the same choice again is a change again
  if (file.size > LARGEST) {
    say('Not sent: expected at most ' + LARGEST / 1e6 + ' MB');
    return;
  }
  busy = true;
  away = false; // its words make room for those of the photo
  say('Sending the photo …');
  try {
    const answer = await fetch('photo', {method: 'POST', body: file});
    const told = await answer.json();
    say(told.verdict);
    if (told.lines) show({lines: told.lines, sketch: told.sketch, goal: told.goal});
  } catch (error) {
    say('Not sent: is the computer still in this network?');
  }
  busy = false;
});
field('skip').addEventListener('click', async () => {
  busy = true;
  away = false;
  field('skip').disabled = true;
  say('Looking for another place …');
  try {
    show(await (await fetch('skip', {method: 'POST'})).json());
    say('');
  } catch (error) {
    say('Not sent: is the computer still in this network?');
  }
  field('skip').disabled = false;
  busy = false;
});
const look = async () => {
  if (busy) return;
  try {
    show(await (await fetch('state')).json());
    if (away) say('');
    away = false;
  } catch (error) {
    away = true;
    say('The computer does not answer.');
  }
};
setInterval(look, 3000);
look();
</script>
</html>
"""
"""
HTML in which NONCE stands for a random word of each answer, LARGEST for the bytes of a photo.

The names of files are not sent.
"""
