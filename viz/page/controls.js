// The bar of controls: file, wavelength, incident angle, scale.

function fillControls(bar, subjects, state, act) {
  const get = (id) => bar.querySelector(`#${id}`);
  const file = get("file");
  subjects.forEach((s, k) => file.append(new Option(s.name, k)));
  file.closest("label").hidden = subjects.length < 2;
  file.addEventListener("change", () => act.subject(Number(file.value)));
  const wave = get("wavelength");
  wave.addEventListener("input", () => act.column(null, Number(wave.value)));
  const tilt = get("theta-i");
  tilt.addEventListener("input", () => act.incident(Number(tilt.value)));
  const turn = get("phi-i");
  turn.addEventListener("input", () => act.azimuth(Number(turn.value)));
  get("less").addEventListener("click", () => act.neighbour(-1));
  get("more").addEventListener("click", () => act.neighbour(1));
  for (const radio of bar.querySelectorAll("input[name=scale]")) radio.addEventListener("change", () => act.set({ scale: radio.value, hold: null }));
  for (const radio of bar.querySelectorAll("input[name=residual]")) radio.addEventListener("change", () => act.set({ residual: radio.value }));
  get("ratio").addEventListener("change", () => act.set({ ratio: get("ratio").value, hold: null }));
  get("hold").addEventListener("change", () => act.hold(get("hold").checked));
  get("copy").addEventListener("click", () => act.copy());
}

function showControls(bar, subjects, state) {
  const get = (id) => bar.querySelector(`#${id}`);
  const s = subjects[state.subject];
  get("file").value = state.subject;
  const wave = get("wavelength");
  wave.max = s.columns - 1;
  wave.value = state.column;
  wave.disabled = s.columns < 2;
  wave.setAttribute("aria-valuetext", s.labels[state.column]);
  get("wavelength-now").textContent = s.labels[state.column];
  get("wavelength-name").textContent = s.nm ? "λ" : "band";
  drawTicks(get("wavelength-ticks"), s.labels.map((_, k) => k), 0, Math.max(1, s.columns - 1), (k) => (s.nm ? number(s.nm[k], 4) : s.labels[k]));
  const tilt = get("theta-i");
  tilt.value = state.thetaI;
  const measured = s.angles.some((a) => Math.abs(a - state.thetaI) <= SAME_ANGLE);
  tilt.setAttribute("aria-valuetext", `${number(state.thetaI)} degrees${measured ? "" : ", not measured"}`);
  tilt.disabled = !s.model && s.angles.length < 2;
  get("theta-i-now").textContent = `${degrees(state.thetaI)}${measured ? "" : " (not measured)"}`;
  drawTicks(get("theta-i-ticks"), s.angles, 0, 89, (a) => number(a, 4));
  const below = s.angles.some((a) => a < state.thetaI - SAME_ANGLE);
  const above = s.angles.some((a) => a > state.thetaI + SAME_ANGLE);
  get("less").disabled = !below;
  get("more").disabled = !above;
  const several = s.azimuths.length > 1 || (s.model && s.model.needs_phi);
  get("phi-i").closest(".slider").hidden = !several;
  get("phi-i").value = state.phiI;
  get("phi-i").setAttribute("aria-valuetext", `${number(state.phiI)} degrees`);
  get("phi-i-now").textContent = `${degrees(state.phiI)}${s.azimuths.some((a) => Math.abs(fold(a - state.phiI)) <= SAME_ANGLE) ? "" : " (not measured)"}`;
  drawTicks(get("phi-i-ticks"), s.azimuths, 0, 359, (a) => number(a, 4));
  for (const radio of bar.querySelectorAll("input[name=scale]")) radio.checked = radio.value === state.scale;
  for (const radio of bar.querySelectorAll("input[name=residual]")) radio.checked = radio.value === state.residual;
  get("residuals").hidden = !s.model;
  bar.querySelector("input[value=sigma]").disabled = !s.sigma;
  const ratio = get("ratio");
  const choices = ratioChoices(state, subjects);
  // An open list would close if its entries were exchanged.
  const listed = JSON.stringify(choices);
  if (ratio.dataset.listed !== listed) ratio.replaceChildren(...choices.map(([key, words]) => new Option(words, key)));
  ratio.dataset.listed = listed;
  ratio.value = choices.some(([key]) => key === state.ratio) ? state.ratio : "mean";
  ratio.closest("label").hidden = state.scale !== "ratio";
  get("hold").checked = !!state.hold;
}

// Marks under a slider where something was measured; a few of them with their values.
function drawTicks(host, values, lo, hi, words) {
  const shown = values.length > 300 ? values.filter((_, k) => k % Math.ceil(values.length / 300) === 0) : values;
  const key = `${shown.length} ${shown[0]} ${shown[shown.length - 1]} ${lo} ${hi}`;
  if (host.dataset.key === key) return;
  host.dataset.key = key;
  let last = -Infinity;
  host.innerHTML = shown
    .map((v, k) => {
      const at = (100 * (v - lo)) / (hi - lo);
      const write = at - last >= 10 || (k === 0 && shown.length > 1);
      if (write) last = at;
      return `<i style="left:${at.toFixed(2)}%">${write ? `<b>${escapeText(words(v))}</b>` : ""}</i>`;
    })
    .join("");
}
