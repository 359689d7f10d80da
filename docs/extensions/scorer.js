// Guides come before the reference, the reference before what was measured.
const LAST = /_benchmarks$|^(attacks|design|references|genindex)$/;
var Scorer = {
  score: ([page, , , , score]) => score + (/^(api\/|cli$)/.test(page) ? 0 : LAST.test(page) ? -40 : 60),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
