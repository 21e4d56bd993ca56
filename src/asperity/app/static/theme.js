// Before anything is drawn: the theme that was chosen on an earlier visit, if any.
(function () {
  try {
    const chosen = localStorage.getItem("asperity-theme");
    if (chosen === "light" || chosen === "dark") {
      document.documentElement.dataset.theme = chosen;
    }
  } catch {
    // Storage may be switched off.
  }
})();
