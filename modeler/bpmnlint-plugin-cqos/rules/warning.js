module.exports = require('../lib/rule')('warning');
