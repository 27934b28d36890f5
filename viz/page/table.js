// The points of the incident direction and wavelength that are shown, as numbers.

const MOST_ROWS = 300;

function pointTable(view) {
  const { s, state } = view;
  const rows = s.rows(state.thetaI, state.phiI).map((n) => {
    const phi = (s.phi[n] + 360) % 360;
    const f = s.measured(n, state.column);
    const model = view.f ? view.f(s.thetaI[n], s.phiI[n], s.thetaR[n], s.phi[n]) : NaN;
    const gap = f - (view.seen ? view.seen(n) : NaN);
    return [s.thetaI[n], s.phiI[n], s.thetaR[n], phi, f, s.error(n, state.column), model, ...seenCell(view, n), (100 * gap) / f, gap / s.error(n, state.column), reason(s, n, state.column)];
  });
  const names = ["theta_i_deg", "phi_i_deg", "theta_r_deg", "phi_deg", "measured_per_sr", "sigma_per_sr", "model_per_sr", ...seenName(view), "deviation_percent", "deviation_sigma", "masked"];
  return { names, rows, remarks: view.remarks };
}

function drawTable(panel, view, act) {
  const { rows } = pointTable(view);
  const heads = ["θi (°)", "φi (°)", "θr (°)", "φ (°)", "measured (1/sr)", "σ (1/sr)", "model (1/sr)", ...seenName(view).map(() => "seen (1/sr)"), "dev. (%)", "dev. (σ)", "masked"];
  const cut = rows.slice(0, MOST_ROWS);
  const body = cut
    .map((row, k) => `<tr data-row="${k}">${row.map((v, j) => `<td>${typeof v === "number" ? number(v, j < 4 ? 6 : 5) : escapeText(v)}</td>`).join("")}</tr>`)
    .join("");
  const more = rows.length > MOST_ROWS ? `<p>${MOST_ROWS} of ${rows.length} rows; the CSV holds all.</p>` : "";
  panel.figure.innerHTML = rows.length
    ? `<details${panel.figure.querySelector("details[open]") ? " open" : ""}><summary>${counted(rows.length, "point")} at this incident angle and wavelength</summary><div class="scroll" tabindex="0" role="region" aria-label="table of points"><table><thead><tr>${heads.map((h) => `<th scope="col">${h}</th>`).join("")}</tr></thead><tbody>${body}</tbody></table></div>${more}</details>`
    : "<p>Nothing is measured at this incident angle.</p>";
  panel.figure.onclick = (event) => {
    const line = event.target.closest("tr[data-row]");
    if (line) act.direction(cut[line.dataset.row][2], cut[line.dataset.row][3]);
  };
}
