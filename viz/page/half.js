// Half and difference angles (Rusinkiewicz, Eurographics Workshop on Rendering 1998), degrees: theta_h from the
// normal to the half vector, theta_d from the half vector to the source, phi_d its azimuth about the half vector.

// Source and detector of half and difference angles, the half vector in the plane phi_i = 0 turned by phi_h = 0;
// null where one of them is below the horizon.
function directionsOfHalf(thetaH, thetaD, phiD) {
  const [sh, ch, sd, cd] = [sinOf(thetaH), cosOf(thetaH), sinOf(thetaD), cosOf(thetaD)];
  const [sp, cp] = [sinAny(fold(phiD)), sinAny(90 - Math.abs(fold(phiD)))];
  // In the frame of the half vector source and detector are (±sd cp, ±sd sp, cd); turned about y by theta_h.
  const turned = (x, y) => [x * ch + cd * sh, y, cd * ch - x * sh];
  const [i, r] = [turned(sd * cp, sd * sp), turned(-sd * cp, -sd * sp)];
  if (i[2] <= 0.001 || r[2] <= 0.001) return null;
  const zenith = (v) => Math.atan2(Math.hypot(v[0], v[1]), v[2]) / RAD;
  const azimuth = (v) => Math.atan2(v[1], v[0]) / RAD;
  const phi = Math.hypot(r[0], r[1]) > 1e-12 && Math.hypot(i[0], i[1]) > 1e-12 ? azimuth(r) - azimuth(i) : 180;
  return { thetaI: zenith(i), thetaR: zenith(r), phi: ((phi % 360) + 360) % 360 };
}

// Half and difference angles of a source and a detector.
function halfOfDirections(thetaI, thetaR, phi) {
  const of = (theta, azimuth) => {
    const s = sinOf(theta);
    return [s * Math.cos(azimuth * RAD), s * Math.sin(azimuth * RAD), cosOf(theta)];
  };
  const [i, r] = [of(thetaI, 0), of(thetaR, phi)];
  const sum = i.map((v, k) => v + r[k]);
  const length = Math.hypot(...sum);
  const h = sum.map((v) => v / length);
  const thetaH = Math.atan2(Math.hypot(h[0], h[1]), h[2]) / RAD;
  const gap = Math.hypot(...i.map((v, k) => v - r[k])) / 2;
  const thetaD = Math.atan2(gap, length / 2) / RAD;
  const turn = Math.hypot(h[0], h[1]) > 1e-12 ? Math.atan2(h[1], h[0]) : 0;
  const [c, s] = [Math.cos(-turn), Math.sin(-turn)];
  const [x, y] = [i[0] * c - i[1] * s, i[0] * s + i[1] * c];
  const tilt = thetaH * RAD;
  const dx = x * Math.cos(tilt) - i[2] * Math.sin(tilt);
  const phiD = Math.atan2(y, dx) / RAD;
  return { thetaH, thetaD, phiD: phiD < 0 ? phiD + 360 : phiD };
}
