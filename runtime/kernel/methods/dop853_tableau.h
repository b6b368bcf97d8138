/* Coefficients of DOP853, the explicit Runge-Kutta method of order 8 of Dormand and Prince with error
 * estimates of order 5 and 3 and a dense output of order 7.
 *
 * E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993,
 * section II.5 and II.6; digits as in the authors' program DOP853.
 *
 * Stages are counted from 1; stage 13 is the derivative at the end of the step, 14 to 16 serve the dense
 * output. c: nodes, a: stage weights, b: weights of the solution, e5: weights of the error estimate of order
 * 5, bhh: weights of the embedded solution of order 3, d: weights of dense coefficients 4 to 7.
 */
#ifndef MECH_DOP853_TABLEAU_H
#define MECH_DOP853_TABLEAU_H

#include "real.h"

/* clang-format off */
static const mech_real c02 = MECH_C(0.526001519587677318785587544488e-01);
static const mech_real c03 = MECH_C(0.789002279381515978178381316732e-01);
static const mech_real c04 = MECH_C(0.118350341907227396726757197510);
static const mech_real c05 = MECH_C(0.281649658092772603273242802490);
static const mech_real c06 = MECH_C(0.333333333333333333333333333333);
static const mech_real c07 = MECH_C(0.25);
static const mech_real c08 = MECH_C(0.307692307692307692307692307692);
static const mech_real c09 = MECH_C(0.651282051282051282051282051282);
static const mech_real c10 = MECH_C(0.6);
static const mech_real c11 = MECH_C(0.857142857142857142857142857142);
static const mech_real c14 = MECH_C(0.1);
static const mech_real c15 = MECH_C(0.2);
static const mech_real c16 = MECH_C(0.777777777777777777777777777778);

static const mech_real a0201 = MECH_C(5.26001519587677318785587544488e-2);

static const mech_real a0301 = MECH_C(1.97250569845378994544595329183e-2);
static const mech_real a0302 = MECH_C(5.91751709536136983633785987549e-2);

static const mech_real a0401 = MECH_C(2.95875854768068491816892993775e-2);
static const mech_real a0403 = MECH_C(8.87627564304205475450678981324e-2);

static const mech_real a0501 = MECH_C(2.41365134159266685502369798665e-1);
static const mech_real a0503 = MECH_C(-8.84549479328286085344864962717e-1);
static const mech_real a0504 = MECH_C(9.24834003261792003115737966543e-1);

static const mech_real a0601 = MECH_C(3.7037037037037037037037037037e-2);
static const mech_real a0604 = MECH_C(1.70828608729473871279604482173e-1);
static const mech_real a0605 = MECH_C(1.25467687566822425016691814123e-1);

static const mech_real a0701 = MECH_C(3.7109375e-2);
static const mech_real a0704 = MECH_C(1.70252211019544039314978060272e-1);
static const mech_real a0705 = MECH_C(6.02165389804559606850219397283e-2);
static const mech_real a0706 = MECH_C(-1.7578125e-2);

static const mech_real a0801 = MECH_C(3.70920001185047927108779319836e-2);
static const mech_real a0804 = MECH_C(1.70383925712239993810214054705e-1);
static const mech_real a0805 = MECH_C(1.07262030446373284651809199168e-1);
static const mech_real a0806 = MECH_C(-1.53194377486244017527936158236e-2);
static const mech_real a0807 = MECH_C(8.27378916381402288758473766002e-3);

static const mech_real a0901 = MECH_C(6.24110958716075717114429577812e-1);
static const mech_real a0904 = MECH_C(-3.36089262944694129406857109825);
static const mech_real a0905 = MECH_C(-8.68219346841726006818189891453e-1);
static const mech_real a0906 = MECH_C(2.75920996994467083049415600797e1);
static const mech_real a0907 = MECH_C(2.01540675504778934086186788979e1);
static const mech_real a0908 = MECH_C(-4.34898841810699588477366255144e1);

static const mech_real a1001 = MECH_C(4.77662536438264365890433908527e-1);
static const mech_real a1004 = MECH_C(-2.48811461997166764192642586468);
static const mech_real a1005 = MECH_C(-5.90290826836842996371446475743e-1);
static const mech_real a1006 = MECH_C(2.12300514481811942347288949897e1);
static const mech_real a1007 = MECH_C(1.52792336328824235832596922938e1);
static const mech_real a1008 = MECH_C(-3.32882109689848629194453265587e1);
static const mech_real a1009 = MECH_C(-2.03312017085086261358222928593e-2);

static const mech_real a1101 = MECH_C(-9.3714243008598732571704021658e-1);
static const mech_real a1104 = MECH_C(5.18637242884406370830023853209);
static const mech_real a1105 = MECH_C(1.09143734899672957818500254654);
static const mech_real a1106 = MECH_C(-8.14978701074692612513997267357);
static const mech_real a1107 = MECH_C(-1.85200656599969598641566180701e1);
static const mech_real a1108 = MECH_C(2.27394870993505042818970056734e1);
static const mech_real a1109 = MECH_C(2.49360555267965238987089396762);
static const mech_real a1110 = MECH_C(-3.0467644718982195003823669022);

static const mech_real a1201 = MECH_C(2.27331014751653820792359768449);
static const mech_real a1204 = MECH_C(-1.05344954667372501984066689879e1);
static const mech_real a1205 = MECH_C(-2.00087205822486249909675718444);
static const mech_real a1206 = MECH_C(-1.79589318631187989172765950534e1);
static const mech_real a1207 = MECH_C(2.79488845294199600508499808837e1);
static const mech_real a1208 = MECH_C(-2.85899827713502369474065508674);
static const mech_real a1209 = MECH_C(-8.87285693353062954433549289258);
static const mech_real a1210 = MECH_C(1.23605671757943030647266201528e1);
static const mech_real a1211 = MECH_C(6.43392746015763530355970484046e-1);

static const mech_real a1401 = MECH_C(5.61675022830479523392909219681e-2);
static const mech_real a1407 = MECH_C(2.53500210216624811088794765333e-1);
static const mech_real a1408 = MECH_C(-2.46239037470802489917441475441e-1);
static const mech_real a1409 = MECH_C(-1.24191423263816360469010140626e-1);
static const mech_real a1410 = MECH_C(1.5329179827876569731206322685e-1);
static const mech_real a1411 = MECH_C(8.20105229563468988491666602057e-3);
static const mech_real a1412 = MECH_C(7.56789766054569976138603589584e-3);
static const mech_real a1413 = MECH_C(-8.298e-3);

static const mech_real a1501 = MECH_C(3.18346481635021405060768473261e-2);
static const mech_real a1506 = MECH_C(2.83009096723667755288322961402e-2);
static const mech_real a1507 = MECH_C(5.35419883074385676223797384372e-2);
static const mech_real a1508 = MECH_C(-5.49237485713909884646569340306e-2);
static const mech_real a1511 = MECH_C(-1.08347328697249322858509316994e-4);
static const mech_real a1512 = MECH_C(3.82571090835658412954920192323e-4);
static const mech_real a1513 = MECH_C(-3.40465008687404560802977114492e-4);
static const mech_real a1514 = MECH_C(1.41312443674632500278074618366e-1);

static const mech_real a1601 = MECH_C(-4.28896301583791923408573538692e-1);
static const mech_real a1606 = MECH_C(-4.69762141536116384314449447206);
static const mech_real a1607 = MECH_C(7.68342119606259904184240953878);
static const mech_real a1608 = MECH_C(4.06898981839711007970213554331);
static const mech_real a1609 = MECH_C(3.56727187455281109270669543021e-1);
static const mech_real a1613 = MECH_C(-1.39902416515901462129418009734e-3);
static const mech_real a1614 = MECH_C(2.9475147891527723389556272149);
static const mech_real a1615 = MECH_C(-9.15095847217987001081870187138);

static const mech_real b01 = MECH_C(5.42937341165687622380535766363e-2);
static const mech_real b06 = MECH_C(4.45031289275240888144113950566);
static const mech_real b07 = MECH_C(1.89151789931450038304281599044);
static const mech_real b08 = MECH_C(-5.8012039600105847814672114227);
static const mech_real b09 = MECH_C(3.1116436695781989440891606237e-1);
static const mech_real b10 = MECH_C(-1.52160949662516078556178806805e-1);
static const mech_real b11 = MECH_C(2.01365400804030348374776537501e-1);
static const mech_real b12 = MECH_C(4.47106157277725905176885569043e-2);

static const mech_real bhh01 = MECH_C(0.244094488188976377952755905512);
static const mech_real bhh09 = MECH_C(0.733846688281611857341361741547);
static const mech_real bhh12 = MECH_C(0.220588235294117647058823529412e-1);

static const mech_real e501 = MECH_C(0.1312004499419488073250102996e-1);
static const mech_real e506 = MECH_C(-0.1225156446376204440720569753e+1);
static const mech_real e507 = MECH_C(-0.4957589496572501915214079952);
static const mech_real e508 = MECH_C(0.1664377182454986536961530415e+1);
static const mech_real e509 = MECH_C(-0.3503288487499736816886487290);
static const mech_real e510 = MECH_C(0.3341791187130174790297318841);
static const mech_real e511 = MECH_C(0.8192320648511571246570742613e-1);
static const mech_real e512 = MECH_C(-0.2235530786388629525884427845e-1);

static const mech_real d401 = MECH_C(-0.84289382761090128651353491142e+1);
static const mech_real d406 = MECH_C(0.56671495351937776962531783590);
static const mech_real d407 = MECH_C(-0.30689499459498916912797304727e+1);
static const mech_real d408 = MECH_C(0.23846676565120698287728149680e+1);
static const mech_real d409 = MECH_C(0.21170345824450282767155149946e+1);
static const mech_real d410 = MECH_C(-0.87139158377797299206789907490);
static const mech_real d411 = MECH_C(0.22404374302607882758541771650e+1);
static const mech_real d412 = MECH_C(0.63157877876946881815570249290);
static const mech_real d413 = MECH_C(-0.88990336451333310820698117400e-1);
static const mech_real d414 = MECH_C(0.18148505520854727256656404962e+2);
static const mech_real d415 = MECH_C(-0.91946323924783554000451984436e+1);
static const mech_real d416 = MECH_C(-0.44360363875948939664310572000e+1);

static const mech_real d501 = MECH_C(0.10427508642579134603413151009e+2);
static const mech_real d506 = MECH_C(0.24228349177525818288430175319e+3);
static const mech_real d507 = MECH_C(0.16520045171727028198505394887e+3);
static const mech_real d508 = MECH_C(-0.37454675472269020279518312152e+3);
static const mech_real d509 = MECH_C(-0.22113666853125306036270938578e+2);
static const mech_real d510 = MECH_C(0.77334326684722638389603898808e+1);
static const mech_real d511 = MECH_C(-0.30674084731089398182061213626e+2);
static const mech_real d512 = MECH_C(-0.93321305264302278729567221706e+1);
static const mech_real d513 = MECH_C(0.15697238121770843886131091075e+2);
static const mech_real d514 = MECH_C(-0.31139403219565177677282850411e+2);
static const mech_real d515 = MECH_C(-0.93529243588444783865713862664e+1);
static const mech_real d516 = MECH_C(0.35816841486394083752465898540e+2);

static const mech_real d601 = MECH_C(0.19985053242002433820987653617e+2);
static const mech_real d606 = MECH_C(-0.38703730874935176555105901742e+3);
static const mech_real d607 = MECH_C(-0.18917813819516756882830838328e+3);
static const mech_real d608 = MECH_C(0.52780815920542364900561016686e+3);
static const mech_real d609 = MECH_C(-0.11573902539959630126141871134e+2);
static const mech_real d610 = MECH_C(0.68812326946963000169666922661e+1);
static const mech_real d611 = MECH_C(-0.10006050966910838403183860980e+1);
static const mech_real d612 = MECH_C(0.77771377980534432092869265740);
static const mech_real d613 = MECH_C(-0.27782057523535084065932004339e+1);
static const mech_real d614 = MECH_C(-0.60196695231264120758267380846e+2);
static const mech_real d615 = MECH_C(0.84320405506677161018159903784e+2);
static const mech_real d616 = MECH_C(0.11992291136182789328035130030e+2);

static const mech_real d701 = MECH_C(-0.25693933462703749003312586129e+2);
static const mech_real d706 = MECH_C(-0.15418974869023643374053993627e+3);
static const mech_real d707 = MECH_C(-0.23152937917604549567536039109e+3);
static const mech_real d708 = MECH_C(0.35763911791061412378285349910e+3);
static const mech_real d709 = MECH_C(0.93405324183624310003907691704e+2);
static const mech_real d710 = MECH_C(-0.37458323136451633156875139351e+2);
static const mech_real d711 = MECH_C(0.10409964950896230045147246184e+3);
static const mech_real d712 = MECH_C(0.29840293426660503123344363579e+2);
static const mech_real d713 = MECH_C(-0.43533456590011143754432175058e+2);
static const mech_real d714 = MECH_C(0.96324553959188282948394950600e+2);
static const mech_real d715 = MECH_C(-0.39177261675615439165231486172e+2);
static const mech_real d716 = MECH_C(-0.14972683625798562581422125276e+3);
/* clang-format on */

#endif
