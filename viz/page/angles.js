// Angles of one direction, as models take them: each is the sine of an angle that is exact before it is
// rounded to radians, so that half-angle forms keep their precision next to the mirror direction.

const RAD = Math.PI / 180;

const sinOf = (degrees) => Math.sin(degrees * RAD);
const cosOf = (degrees) => Math.sin((90 - Math.abs(degrees)) * RAD);

// Fold an azimuth to (-180, 180].
function fold(phi) {
  let turn = phi % 360;
  if (turn > 180) turn -= 360;
  return turn <= -180 ? turn + 360 : turn;
}

// Sine and cosine of any angle in (-180, 180].
function sinAny(degrees) {
  const size = Math.abs(degrees);
  const folded = size > 90 ? 180 - size : size;
  const value = folded > 45 ? Math.cos((90 - folded) * RAD) : Math.sin(folded * RAD);
  return degrees < 0 ? -value : value;
}

function anglesOf(thetaI, phiI, thetaR, phi, a) {
  const half = fold(phi) / 2;
  const h = (thetaI - thetaR) / 2;
  const m = (thetaI + thetaR) / 2;
  a.sin_i = sinOf(thetaI);
  a.cos_i = cosOf(thetaI);
  a.sin_r = sinOf(thetaR);
  a.cos_r = cosOf(thetaR);
  a.sin_h = sinOf(h);
  a.cos_h = cosOf(h);
  a.sin_m = sinOf(m);
  a.cos_m = cosOf(m);
  a.sin_p = sinOf(half);
  a.cos_p = cosOf(half);
  a.psi = 2 * Math.abs(half) * RAD;
  const turned = fold(phiI);
  a.sin_phi_i = sinAny(turned);
  a.cos_phi_i = sinAny(90 - Math.abs(turned));
  return a;
}

const newAngles = () => anglesOf(0, 0, 0, 0, {});

// World frame: z along the normal, x forward (phi = 180), phi anticlockwise seen from above.
function vectorOf(theta, phi) {
  const s = Math.sin(theta * RAD);
  return [-s * Math.cos(phi * RAD), -s * Math.sin(phi * RAD), Math.cos(theta * RAD)];
}

function anglesOfVector(x, y, z) {
  const theta = Math.atan2(Math.hypot(x, y), z) / RAD;
  const phi = Math.atan2(-y, -x) / RAD;
  return [theta, phi < 0 ? phi + 360 : phi];
}

// Degrees between two directions.
function separation(theta1, phi1, theta2, phi2) {
  const a = vectorOf(theta1, phi1);
  const b = vectorOf(theta2, phi2);
  const d = Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  return (2 * Math.asin(Math.min(1, d / 2))) / RAD;
}
